//! The table of reasons for readers: docs/errors.md for people, JSON for clients in other languages.
//!
//! Enters: the table. Leaves: the text of both files, which tests compare with the committed ones.

use std::fmt::Write as _;

use tonic::Code;

use crate::reason::Reason;

/// The page docs/errors.md.
pub fn errors_page() -> String {
    let diverged: Vec<_> = Reason::ALL
        .iter()
        .filter(|reason| reason.is_divergence())
        .map(|r| format!("`{}`", r.name()))
        .collect();
    let mut page = format!(
        "# Errors\n\n\
         Every error that the server sends is a gRPC status whose details hold a `google.rpc.ErrorInfo`\n\
         with domain `nappe.v1`, one of the reasons below, and the numbers of the message as metadata.\n\
         Reasons never change their meaning. Errors of single fields also carry a `google.rpc.BadRequest`.\n\n\
         A connection that the server does not accept cannot carry a reason (too many, silent for\n\
         too long, cut at the end of a drain): it ends without a status, and clients report `UNAVAILABLE`.\n\n\
         Divergence is FAILED_PRECONDITION, since no retry helps: the state of the session is what has to change.\n\
         Of a run that diverged, the command exits with 3: {diverged}.\n\n\
         This page and `proto/nappe/v1/reasons.json`, for clients in other languages, are generated from\n\
         `proto/src/reason.rs`; a test compares them.\n\n\
         | reason | code | meaning | what to do |\n|---|---|---|---|\n",
        diverged = diverged.join(", "),
    );
    for reason in Reason::ALL {
        let (name, code) = (reason.name(), code_name(reason.code()));
        writeln!(page, "| `{name}` | {code} | {} | {} |", reason.meaning(), reason.remedy())
            .expect("writing to a String succeeds");
    }
    page
}

/// The file proto/nappe/v1/reasons.json: an array with an object for each reason, for clients that are not in Rust.
pub fn reasons_json() -> String {
    // The texts hold no control characters, so that Rust's escapes are those of JSON.
    let line = |reason: &Reason| {
        format!(
            "  {{\"reason\": {:?}, \"code\": {:?}, \"is_divergence\": {}, \"meaning\": {:?}, \"remedy\": {:?}}}",
            reason.name(),
            code_name(reason.code()),
            reason.is_divergence(),
            reason.meaning(),
            reason.remedy(),
        )
    };
    let lines: Vec<_> = Reason::ALL.iter().map(line).collect();
    format!("[\n{}\n]\n", lines.join(",\n"))
}

/// The name of a status code as the gRPC specification writes it.
pub fn code_name(code: Code) -> String {
    let mut name = String::new();
    for c in format!("{code:?}").chars() {
        if c.is_ascii_uppercase() && !name.is_empty() {
            name.push('_');
        }
        name.push(c.to_ascii_uppercase());
    }
    name
}
