//! The decoder of docs/frames.md, in Python, on the golden vectors of packed arrays.

use std::{fs, process::Command};

use crate::shell::{Failure, Shell};

/// The page that the decoder stands in.
const PAGE: &str = "docs/frames.md";

/// Runs the page's code where Python and numpy are installed.
pub(crate) fn decoder(shell: &mut Shell) -> Result<(), Failure> {
    let title = "decoder in Python";
    let Some(python) = shell.python_with("numpy") else {
        shell.skip(title, "numpy is not installed (PyPI package numpy)");
        return Ok(());
    };
    let page = fs::read_to_string(shell.root().join(PAGE))
        .map_err(|error| Failure(format!("{PAGE} cannot be read: {error}")))?;
    let code = blocks(&page, "python");
    if code.is_empty() {
        return Err(Failure(format!("{PAGE} has no code in Python")));
    }
    shell.run(title, Command::new(python).arg("-c").arg(code))
}

/// The code of all blocks in a language, one after the other.
fn blocks(page: &str, language: &str) -> String {
    let opening = format!("```{language}\n");
    let block = |rest: &str| rest.split("```").next().unwrap_or_default().to_owned();
    page.split(&opening).skip(1).map(block).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn blocks_of_a_language_are_joined() {
        let page = "a\n```python\nx = 1\n```\n```sh\nls\n```\n```python\ny = 2\n```\n";
        assert_eq!(blocks(page, "python"), "x = 1\ny = 2\n");
        assert_eq!(blocks(page, "c"), "");
    }
}
