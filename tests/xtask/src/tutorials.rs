//! `cargo xtask tutorials`: does what `docs/tutorials/*.md` and `docs/guides/*.md` tell a reader to do.
//!
//! Reads the pages; runs their blocks in order in a fresh copy of the repository, with the programs that
//! were built on PATH; fails at the first block that does not do what its page says. The word after a
//! block's language says what happens to it:
//!
//! | block | what happens |
//! |---|---|
//! | `sh` | bash runs it at the root of the copy, and must succeed |
//! | `sh server` | is started in place of the one before it, and left running until the page ends |
//! | `text output` | every line stands in what the block before printed, in this order; `...` stands for anything |
//! | `toml file=PATH`, and other languages | is written to that file of the copy |
//! | `rust same=PATH`, and other languages | stands in that file of the repository, word for word |
//! | `console`, `text` | is shown, and not run |

use std::{
    fs,
    io::{BufRead as _, BufReader},
    net::TcpListener,
    path::{Path, PathBuf},
    process::{Child, ChildStdout, Command, Stdio},
};

use crate::{
    copy::Copy,
    shell::{Failure, Shell},
};

/// Where the pages are.
const FOLDERS: [&str; 2] = ["docs/tutorials", "docs/guides"];

/// A fenced block of a page.
#[derive(Debug, PartialEq)]
struct Block {
    /// Line of the page on which it opens, from 1.
    line: usize,
    action: Action,
    text: String,
}

#[derive(Debug, PartialEq)]
enum Action {
    Commands,
    Server,
    Output,
    File(String),
    Same(String),
    Shown,
}

/// Runs every page, or those that are named.
pub(crate) fn run(shell: &mut Shell, names: &[String]) -> Result<(), Failure> {
    let mut pages: Vec<PathBuf> = Vec::new();
    for folder in FOLDERS {
        pages.extend(listed(&shell.root().join(folder))?);
    }
    pages.retain(|page| names.is_empty() || names.iter().any(|name| page.file_stem() == Some(name.as_ref())));
    if pages.is_empty() {
        return Err(Failure(format!("{} have no page {}", FOLDERS.join(" and "), names.join(", "))));
    }

    for page in pages {
        let name = page.file_stem().unwrap_or_default().to_string_lossy().into_owned();
        let place = page.strip_prefix(shell.root()).unwrap_or(&page).display().to_string();
        let title = format!("tutorial {name}");
        let text = fs::read_to_string(&page).map_err(|error| failure(&page, &error))?;
        let modules = if text.contains("gymnasium") {
            "google.rpc, grpc, gymnasium, numpy"
        } else {
            "google.rpc, grpc, numpy"
        };
        if text.contains("import nappe") && shell.python_with(modules).is_none() {
            shell.skip(&title, "what the package for Python needs is not installed: .ci/run does");
            continue;
        }
        let within = |Failure(what)| Failure(format!("{place}:{what}"));
        shell.step(&title, |shell| follow(shell, &text).map_err(within))?;
    }
    Ok(())
}

/// Does what a page says.
fn follow(shell: &Shell, page: &str) -> Result<(), Failure> {
    let blocks = blocks(page).map_err(Failure)?;
    let mut reader = Reader::new(shell)?;
    for block in &blocks {
        reader.follow(block).map_err(|Failure(what)| Failure(format!("{}: {what}", block.line)))?;
    }
    Ok(())
}

/// The pages in a folder, sorted.
fn listed(folder: &Path) -> Result<Vec<PathBuf>, Failure> {
    let entries = fs::read_dir(folder).map_err(|error| failure(folder, &error))?;
    let mut pages: Vec<_> = entries.filter_map(|entry| Some(entry.ok()?.path())).collect();
    pages.retain(|page| page.extension().is_some_and(|extension| extension == "md"));
    pages.sort();
    Ok(pages)
}

/// The fenced blocks of a page, or a line and what is wrong there.
fn blocks(page: &str) -> Result<Vec<Block>, String> {
    let mut found = Vec::new();
    let mut lines = page.lines().zip(1..);
    while let Some((opening, line)) = lines.next() {
        let Some(info) = opening.strip_prefix("```") else { continue };
        let body: Vec<_> = lines.by_ref().map(|(text, _)| text).take_while(|text| *text != "```").collect();
        let action = action(info).ok_or_else(|| format!("{line}: nothing is said about a block '{info}'"))?;
        found.push(Block { line, action, text: body.join("\n") + "\n" });
    }
    Ok(found)
}

/// What happens to a block whose fence says `info`.
fn action(info: &str) -> Option<Action> {
    let (language, word) = info.split_once(' ').unwrap_or((info, ""));
    let named = |key: &str| word.strip_prefix(key).map(str::to_owned);
    match (language, word) {
        ("sh", "") => Some(Action::Commands),
        ("sh", "server") => Some(Action::Server),
        ("text", "output") => Some(Action::Output),
        ("text" | "console", "") => Some(Action::Shown),
        _ => named("file=").map(Action::File).or_else(|| named("same=").map(Action::Same)),
    }
}

/// One who does what a page says: a copy of the repository, perhaps a server, the last output.
struct Reader {
    root: PathBuf,
    tree: PathBuf,
    /// Where the program is built, and the copy too: its crates have a version of their own.
    target: PathBuf,
    /// Folders before those of PATH.
    path: String,
    /// A free port, for the server and for those who talk to it.
    port: u16,
    server: Option<Child>,
    /// What the server prints, open as long as it runs.
    output: Option<BufReader<ChildStdout>>,
    printed: String,
}

impl Reader {
    fn new(shell: &Shell) -> Result<Self, Failure> {
        let mut copy = Copy::of(shell, "tutorials")?;
        copy.with_one_instruction_set()?;
        let tree = copy.write(shell)?;
        let own = [shell.target().join("release"), shell.target().join("tools/python/bin")];
        let path = std::env::var("PATH").unwrap_or_default();
        let free = TcpListener::bind("127.0.0.1:0").and_then(|listener| listener.local_addr());
        let port = free.map_err(|error| Failure(format!("no free port: {error}")))?.port();
        Ok(Self {
            root: shell.root().to_path_buf(),
            tree,
            target: shell.target(),
            path: format!("{}:{}:{path}", own[0].display(), own[1].display()),
            port,
            server: None,
            output: None,
            printed: String::new(),
        })
    }

    fn follow(&mut self, block: &Block) -> Result<(), Failure> {
        let text = &block.text;
        match &block.action {
            Action::Commands => self.printed = self.commands(text)?,
            Action::Server => self.serve(text)?,
            Action::Output => missing(text, &self.printed).map_or(Ok(()), |line| {
                Err(Failure(format!("no '{line}' in what was printed:\n{}", self.printed)))
            })?,
            Action::File(path) => write(&self.tree.join(path), text.as_bytes())?,
            Action::Same(path) => {
                let file = self.root.join(path);
                let there = fs::read_to_string(&file).map_err(|error| failure(&file, &error))?;
                if !there.contains(text.as_str()) {
                    return Err(Failure(format!("{path} holds other text")));
                }
            }
            Action::Shown => {}
        }
        Ok(())
    }

    /// Bash at the root of the copy.
    fn bash(&self, script: &str) -> Command {
        let mut command = Command::new("bash");
        command.args(["-euo", "pipefail", "-c", script]).current_dir(&self.tree).env("PATH", &self.path);
        command.env("NAPPE_ADDRESS", format!("127.0.0.1:{}", self.port));
        command.env("NAPPE_SERVER", format!("http://127.0.0.1:{}", self.port));
        command.env("CARGO_TARGET_DIR", &self.target).stdin(Stdio::null());
        // The copy lies in a folder that the repository ignores: git must not look above it.
        command.env("GIT_CEILING_DIRECTORIES", &self.target);
        Shell::forget_this_crate(&mut command);
        command
    }

    /// Runs commands and gives what they printed, errors after the rest.
    fn commands(&self, script: &str) -> Result<String, Failure> {
        let output = self.bash(script).output().map_err(|error| Failure(format!("bash: {error}")))?;
        let mut printed = String::from_utf8_lossy(&output.stdout).into_owned();
        printed.push_str(&String::from_utf8_lossy(&output.stderr));
        if output.status.success() {
            return Ok(printed);
        }
        Err(Failure(format!("{} of\n{script}{printed}", output.status)))
    }

    /// Starts a program in place of the one that runs, and waits for its first line.
    fn serve(&mut self, script: &str) -> Result<(), Failure> {
        self.end_server();
        let mut command = self.bash(&format!("exec {script}"));
        let mut child = command
            .stdout(Stdio::piped())
            .stderr(Stdio::null())
            .spawn()
            .map_err(|error| Failure(format!("bash: {error}")))?;
        let output = child.stdout.take().expect("its output is a pipe");
        self.server = Some(child);
        let (mut line, mut output) = (String::new(), BufReader::new(output));
        output.read_line(&mut line).map_err(|error| Failure(error.to_string()))?;
        self.output = Some(output);
        if line.is_empty() {
            return Err(Failure(format!("it ended without a word: {script}")));
        }
        Ok(())
    }

    fn end_server(&mut self) {
        if let Some(mut server) = self.server.take() {
            // It may have ended by itself; either way nothing is left running.
            let _ = server.kill();
            let _ = server.wait();
        }
    }
}

impl Drop for Reader {
    fn drop(&mut self) {
        self.end_server();
    }
}

fn write(file: &Path, content: &[u8]) -> Result<(), Failure> {
    let folder = file.parent().expect("a file of the copy is in a folder");
    let written = fs::create_dir_all(folder).and_then(|()| fs::write(file, content));
    written.map_err(|error| failure(file, &error))
}

/// The first line of `wanted` that is not found in `printed`, in order. `...` stands for anything.
fn missing<'a>(wanted: &'a str, printed: &str) -> Option<&'a str> {
    let mut lines = printed.lines();
    wanted.lines().find(|line| !lines.by_ref().any(|there| fits(line, there)))
}

/// Whether the parts of `pattern` between `...` follow each other in `line`.
fn fits(pattern: &str, line: &str) -> bool {
    let mut rest = line;
    pattern.trim().split("...").all(|part| match rest.split_once(part) {
        Some((_, after)) => {
            rest = after;
            true
        }
        None => false,
    })
}

fn failure(file: &Path, error: &std::io::Error) -> Failure {
    Failure(format!("{}: {error}", file.display()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn blocks_say_what_happens_to_them() {
        let page = "Text.\n```sh\nnappe scenes\n```\n```text output\ndemo ...\n```\n```toml file=a/b.toml\nx = 1\n```\n";
        let found = blocks(page).expect("the page is well formed");
        let actions: Vec<_> = found.iter().map(|block| (block.line, &block.action)).collect();
        let file = Action::File("a/b.toml".to_owned());
        assert_eq!(actions, [(2, &Action::Commands), (5, &Action::Output), (8, &file)]);
        assert_eq!(found[0].text, "nappe scenes\n");
        assert_eq!(action("rust same=x.rs"), Some(Action::Same("x.rs".to_owned())));
    }

    #[test]
    fn code_that_nobody_runs_is_refused() {
        assert_eq!(
            blocks("```rust\nfn f() {}\n```\n"),
            Err("1: nothing is said about a block 'rust'".to_owned())
        );
        assert_eq!(action("python"), None);
        assert_eq!(action("sh later"), None);
    }

    #[test]
    fn what_was_printed_is_compared_with_the_page_line_by_line() {
        let printed = "a scene of 12 particles\n600 steps in 2.4 s\n";
        assert_eq!(missing("a scene of ... particles\n... steps in ... s\n", printed), None);
        assert_eq!(missing("... steps\na scene\n", printed), Some("a scene"), "the order counts");
        assert_eq!(missing("700 steps\n", printed), Some("700 steps"));
    }
}
