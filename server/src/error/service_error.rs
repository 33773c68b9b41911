//! An error on its way to a client: a reason, a sentence, the numbers in it, the invalid fields.
//!
//! Enters: what went wrong anywhere in the server. Leaves: a `tonic::Status` with `ErrorInfo`.

use std::{fmt, time::Duration};

use nappe_proto::{DOMAIN, Reason};
use nappe_scene::printable;
use tonic::Status;
use tonic_types::{ErrorDetails, StatusExt as _};

/// Longest sentence and longest value in an error (bytes): a status travels in HTTP headers,
/// which clients read up to 8 or 16 KiB.
const TEXT_BYTES: usize = 1024;

/// A call that failed.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct ServiceError {
    pub reason: Reason,
    /// What happened, where, and what is allowed, in one sentence.
    pub message: String,
    /// The numbers and names in the sentence, for programs.
    pub metadata: Vec<(&'static str, String)>,
    /// Invalid fields of the request, each with what is allowed.
    pub fields: Vec<(String, String)>,
}

impl ServiceError {
    pub(crate) fn new(reason: Reason, message: impl Into<String>) -> Self {
        Self { reason, message: message.into(), metadata: Vec::new(), fields: Vec::new() }
    }

    /// A field of the request that is missing or out of range.
    pub(crate) fn field(field: impl Into<String>, problem: impl Into<String>) -> Self {
        let (field, problem) = (field.into(), problem.into());
        Self::new(Reason::InvalidField, format!("{field}: {problem}"))
            .with("field", &field)
            .at_field(field, problem)
    }

    /// A call or stream that a shutdown ends.
    pub(crate) fn draining() -> Self {
        Self::new(Reason::ServerDraining, "the server is shutting down")
    }

    /// A call or stream whose session is deleted.
    pub(crate) fn session_deleted(id: &str) -> Self {
        Self::new(Reason::SessionDeleted, format!("session '{id}' was deleted")).with("session_id", id)
    }

    /// A bug in the server.
    pub(crate) fn internal(message: impl Into<String>) -> Self {
        Self::new(Reason::Internal, message)
    }

    /// The same error with a value for programs.
    #[must_use]
    pub(crate) fn with(mut self, key: &'static str, value: impl fmt::Display) -> Self {
        self.metadata.push((key, value.to_string()));
        self
    }

    /// The same error, naming an invalid field of the request.
    #[must_use]
    pub(crate) fn at_field(mut self, field: impl Into<String>, problem: impl Into<String>) -> Self {
        self.fields.push((field.into(), problem.into()));
        self
    }
}

impl fmt::Display for ServiceError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}: {}", self.reason.name(), self.message)
    }
}

impl std::error::Error for ServiceError {}

impl From<ServiceError> for Status {
    fn from(error: ServiceError) -> Self {
        let metadata: Vec<(String, String)> =
            error.metadata.iter().map(|(key, value)| ((*key).to_owned(), shortened(value))).collect();
        let mut details = ErrorDetails::new();
        details.set_error_info(
            error.reason.name(),
            DOMAIN,
            metadata.into_iter().collect::<std::collections::HashMap<_, _>>(),
        );

        for (field, problem) in &error.fields {
            details.add_bad_request_violation(shortened(field), shortened(problem));
        }

        // What an option of the server alone lets pass is not asked for again.
        let may_pass = !error.metadata.iter().any(|(key, _)| *key == "option");
        if matches!(error.reason, Reason::ServerDraining | Reason::TooManyUploads | Reason::RequestMemoryFull)
            && may_pass
        {
            details.set_retry_info(Some(Duration::from_secs(1)));
        }

        Self::with_error_details(error.reason.code(), shortened(&error.message), details)
    }
}

/// `text` up to [`TEXT_BYTES`], cut between characters; what it quotes of a request is made printable.
fn shortened(text: &str) -> String {
    let text = text.lines().map(printable).collect::<Vec<_>>().join("\n");
    if text.len() <= TEXT_BYTES {
        return text;
    }
    let end = (0..=TEXT_BYTES - 3).rev().find(|end| text.is_char_boundary(*end)).unwrap_or(0);
    format!("{}...", &text[..end])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_status_carries_reason_metadata_and_fields() {
        let error = ServiceError::field("page_size", "is -1: 0 or more").with("value", -1);
        let status = Status::from(error);
        let info = status.get_details_error_info().expect("every status has an ErrorInfo");
        assert_eq!((info.reason.as_str(), info.domain.as_str()), ("INVALID_FIELD", DOMAIN));
        assert_eq!(info.metadata["value"], "-1");
        let bad = status.get_details_bad_request().expect("a field is named");
        assert_eq!(bad.field_violations[0].field, "page_size");
    }

    #[test]
    fn a_long_text_is_cut_between_characters() {
        let status = Status::from(ServiceError::new(Reason::InvalidScene, "é".repeat(5000)));
        assert!(status.message().len() <= TEXT_BYTES && status.message().ends_with("é..."));
    }

    #[test]
    fn what_a_request_says_reaches_no_terminal_as_it_is() {
        let error =
            ServiceError::new(Reason::InvalidChange, "no body is named '\u{1b}[2J'").with("name", "\u{202e}");
        let status = Status::from(error);
        assert_eq!(status.message(), "no body is named '\\u{1b}[2J'");
        let info = status.get_details_error_info().expect("every status has an ErrorInfo");
        assert_eq!(info.metadata["name"], "\\u{202e}");
    }
}
