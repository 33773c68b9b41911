//! Deployment files start programs that exist, from files that exist, with settings that exist.

use std::collections::BTreeSet;

use serde_json::Value;

use crate::{assert_none, tree};

/// Every program of the workspace, after its package.
fn programs() -> Vec<(String, String)> {
    let text = tree::run(env!("CARGO"), &["metadata", "--no-deps", "--offline", "--format-version", "1"]);
    let metadata: Value = serde_json::from_str(&text).expect("cargo prints JSON");
    let list = |value: &Value| value.as_array().cloned().unwrap_or_default();
    let name = |value: &Value| value["name"].as_str().unwrap_or_default().to_owned();
    let mut found = Vec::new();
    for package in list(&metadata["packages"]) {
        let is_program = |target: &&Value| list(&target["kind"]).contains(&Value::from("bin"));
        found.extend(list(&package["targets"]).iter().filter(is_program).map(|t| (name(&package), name(t))));
    }
    found
}

/// Complaints about a Dockerfile: what it copies, builds, and starts.
fn against_dockerfile(text: &str, programs: &[(String, String)]) -> Vec<String> {
    let mut complaints = Vec::new();
    let mut built = BTreeSet::new();
    let mut installed = BTreeSet::new();
    for line in text.lines().filter(|line| !line.starts_with('#')) {
        let words: Vec<_> = line.split_whitespace().collect();
        match words.as_slice() {
            ["COPY", "--from=build", from, to] => {
                let program = from.strip_prefix("/build/target/release/").unwrap_or(from);
                if !built.contains(program) {
                    complaints.push(format!("{from} is copied, but no build makes it"));
                }
                installed.insert((*to).to_owned());
            }
            ["COPY", sources @ .., _] => {
                let missing = sources.iter().filter(|path| !tree::root().join(path).exists());
                complaints.extend(missing.map(|path| format!("{path} is copied, but is not there")));
            }
            ["RUN", "cargo", "build", arguments @ ..] => {
                let package = arguments.iter().skip_while(|word| **word != "--package").nth(1);
                let made =
                    programs.iter().filter(|(owner, _)| package.is_some_and(|package| package == owner));
                built.extend(made.map(|(_, program)| program.as_str()));
            }
            ["ENTRYPOINT", program] if !installed.contains(program.trim_matches(['[', ']', '"'])) => {
                complaints.push(format!("{program} is started, but not installed"));
            }
            _ => {}
        }
    }
    if installed.is_empty() {
        complaints.push("no program is installed".to_owned());
    }
    complaints
}

/// Complaints about a unit: it starts a program of ours, without options that the server lacks.
fn against_unit(text: &str, programs: &[(String, String)]) -> Vec<String> {
    let Some(command) = text.lines().find_map(|line| line.strip_prefix("ExecStart=")) else {
        return vec!["the unit starts nothing".to_owned()];
    };
    let program =
        command.split_whitespace().next().and_then(|path| path.rsplit('/').next()).unwrap_or_default();
    let known = programs.iter().any(|(_, name)| name == program);
    (!known).then(|| format!("the unit starts '{program}', which nothing builds")).into_iter().collect()
}

/// Complaints about the addresses that a unit lets its server reach and be reached from: loopback alone, where it listens.
fn against_addresses(text: &str) -> Vec<String> {
    let values = |key: &str| -> Vec<&str> {
        text.lines().filter_map(|line| line.strip_prefix(key)).flat_map(str::split_whitespace).collect()
    };
    let mut complaints = Vec::new();
    if values("IPAddressDeny=") != ["any"] {
        complaints.push("addresses that are not allowed are not denied".to_owned());
    }
    if values("IPAddressAllow=") != ["localhost"] {
        complaints.push("loopback is not what is allowed".to_owned());
    }
    let set = text.lines().filter(|line| !line.starts_with('#'));
    let elsewhere = set.filter(|line| {
        ["NAPPE_ADDRESS=", "NAPPE_ALLOW_REMOTE=", "--address", "--allow-remote"]
            .iter()
            .any(|word| line.contains(word))
    });
    complaints.extend(elsewhere.map(|line| format!("it listens elsewhere, where nobody reaches it: {line}")));
    complaints
}

/// Whether a unit or a compose file bounds the memory of what it starts.
fn bounds_memory(text: &str) -> bool {
    text.lines().any(|line| ["MemoryMax=", "mem_limit:"].iter().any(|key| line.trim().starts_with(key)))
}

/// Settings (`NAPPE_...`) named in `text` that `config` does not read.
fn against_settings(text: &str, config: &str) -> Vec<String> {
    let words = text.split(|c: char| !c.is_ascii_alphanumeric() && c != '_');
    let settings: BTreeSet<_> = words.filter(|word| word.starts_with("NAPPE_")).collect();
    let unknown = settings.into_iter().filter(|name| !config.contains(&format!("\"{name}\"")));
    unknown.map(|name| format!("{name} is set, but the server does not read it")).collect()
}

#[test]
fn the_image_copies_what_is_there_and_starts_what_it_builds() {
    assert_none(&against_dockerfile(&tree::text("deploy/Dockerfile"), &programs()));
    let compose = tree::text("deploy/compose.yaml");
    assert!(
        compose.contains("dockerfile: deploy/Dockerfile") && compose.contains("context: .."),
        "{compose}"
    );
}

#[test]
fn the_unit_starts_a_program_that_is_built() {
    assert_none(&against_unit(&tree::text("deploy/nappe.service"), &programs()));
}

#[test]
fn the_unit_lets_its_server_talk_to_this_machine_alone_where_it_listens() {
    assert_none(&against_addresses(&tree::text("deploy/nappe.service")));
    let default = tree::text("server/src/address.rs");
    assert!(
        default.contains("IpAddr::V4(Ipv4Addr::LOCALHOST), DEFAULT_PORT)"),
        "the address by default is loopback"
    );
}

#[test]
fn what_is_started_has_a_limit_on_its_memory() {
    for file in ["deploy/nappe.service", "deploy/compose.yaml"] {
        assert!(bounds_memory(&tree::text(file)), "{file}");
    }
    assert!(!bounds_memory("[Service]\n# MemoryMax=1G\n"));
}

#[test]
fn deployment_files_use_settings_that_the_server_reads() {
    // The server writes one name, for ranks.
    let config = tree::text("server/src/config.rs") + &tree::text("server/cluster/src/place.rs");
    for file in tree::sources(|path| path.starts_with("deploy/")) {
        assert_none(&against_settings(&file.text, &config));
    }
}

#[test]
fn the_rules_find_what_they_are_for() {
    let programs = [("nappe-server".to_owned(), "nappe-server".to_owned())];
    let image = "COPY Cargo.toml nowhere ./\nRUN cargo build --release --package nappe-server\n\
        COPY --from=build /build/target/release/nappe-other /bin/x\nENTRYPOINT [\"/bin/y\"]\n";
    assert_eq!(against_dockerfile(image, &programs).len(), 3);
    assert_eq!(against_unit("ExecStart=/usr/local/bin/naperon --x\n", &programs).len(), 1);
    let open =
        "# IPAddressDeny=any\nIPAddressAllow=localhost 10.0.0.0/8\nExecStart=/x --address 0.0.0.0:6277\n";
    assert_eq!(against_addresses(open).len(), 3);
    assert_eq!(
        against_settings("ENV NAPPE_ADRESS=1 NAPPE_X=2", "env = \"NAPPE_X\""),
        ["NAPPE_ADRESS is set, but the server does not read it"]
    );
}
