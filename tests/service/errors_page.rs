//! Files that are made from the contract: its page, those of the table of reasons, its descriptors.

use std::{fs, path::Path};

use nappe_proto::{Reason, contract_descriptors, contract_page, errors_page, reasons_json};
use serde_json::Value;

/// Compares a committed file with what the code says, or writes it.
fn compare(file: &str, made: impl AsRef<[u8]>) {
    let made = made.as_ref();
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("..").join(file);
    if std::env::var_os("NAPPE_BLESS").is_some() {
        fs::write(&path, made).expect("the file can be written");
    }

    let written = fs::read(&path).unwrap_or_default();
    assert!(written == made, "{file} is out of date: run `cargo xtask bless pages` and look at the change");
}

#[test]
fn the_page_of_errors_and_the_constants_of_other_languages_are_what_the_code_says() {
    compare("docs/errors.md", errors_page());
    compare("proto/nappe/v1/reasons.json", reasons_json());
    compare("client/python/src/nappe/reasons.json", reasons_json());
}

#[test]
fn the_page_of_the_contract_is_what_its_files_say() {
    let page = contract_page();
    for part in
        ["## SimulationService", "### WatchFramesRequest", "optional uint64", "one of `scene`", "(#session)"]
    {
        assert!(page.contains(part), "'{part}' is missing");
    }
    compare("docs/contract.md", page);
}

#[test]
fn the_page_of_descriptors_that_python_makes_its_messages_from_is_the_contract() {
    compare("client/python/src/nappe/contract.binpb", contract_descriptors());
}

#[test]
fn the_constants_of_other_languages_can_be_read() {
    let read: Vec<Value> = serde_json::from_str(&reasons_json()).expect("it is JSON");
    assert_eq!(read.len(), Reason::ALL.len());
    for (value, reason) in read.iter().zip(Reason::ALL) {
        assert_eq!(value["reason"], reason.name());
        assert_eq!(value["is_divergence"], reason.is_divergence());
        assert_eq!(
            (&value["meaning"], &value["remedy"]),
            (&reason.meaning().into(), &reason.remedy().into())
        );
        let code = value["code"].as_str().expect("a word").replace('_', "").to_lowercase();
        assert_eq!(code, format!("{:?}", reason.code()).to_lowercase());
    }
}
