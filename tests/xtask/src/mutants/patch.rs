//! A patch: a text of the numerics that becomes another in the copy, behind a switch.

use crate::copy::replace_once;

/// A text of a file, and what it becomes.
pub(super) struct Patch {
    /// Number of the mutant, or of the first of those that the patch brings; 0 for what they need.
    pub(super) mutant: u32,
    /// File, from the folder of the suite.
    pub(super) file: &'static str,
    /// Text that stands in the file exactly once.
    from: &'static str,
    /// What the mutant makes of it.
    to: &'static str,
    form: Form,
}

/// How a patch is applied.
#[derive(Clone, Copy)]
enum Form {
    /// The text is an expression: `if the mutant is on { to } else { from }`.
    Expression,
    /// `to` in place of `from`: the new text asks for the mutant by itself.
    Text,
}

/// A patch of an expression.
pub(super) const fn expression(
    mutant: u32,
    file: &'static str,
    from: &'static str,
    to: &'static str,
) -> Patch {
    Patch { mutant, file, from, to, form: Form::Expression }
}

/// A patch of any text.
pub(super) const fn text(mutant: u32, file: &'static str, from: &'static str, to: &'static str) -> Patch {
    Patch { mutant, file, from, to, form: Form::Text }
}

impl Patch {
    /// The text of a file with the patch.
    ///
    /// # Errors
    /// When what it replaces does not stand there exactly once: the code was rewritten, and the mutant is to
    /// be stated anew.
    pub(super) fn apply(&self, file: &str) -> Result<String, String> {
        let Self { mutant, from, to, .. } = self;
        let new = match self.form {
            Form::Text => (*to).to_owned(),
            Form::Expression => format!("(if crate::mutant({mutant}) {{ {to} }} else {{ {from} }})"),
        };
        replace_once(file, from, &new).map_err(|reason| format!("mutant {mutant}: {reason}"))
    }

    /// Whether the new text asks for a mutant by itself.
    #[cfg(test)]
    pub(super) fn asks_for(&self, mutant: u32) -> bool {
        self.to.contains(&format!("crate::mutant({mutant})"))
    }
}

#[test]
fn an_expression_keeps_both_forms() {
    let patched = expression(7, "x.rs", "a * b", "a").apply("let c = a * b;");
    assert_eq!(patched.as_deref(), Ok("let c = (if crate::mutant(7) { a } else { a * b });"));
    assert!(text(7, "x.rs", "d", "e").apply("let c = a * b;").is_err());
}
