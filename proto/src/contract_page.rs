//! The contract as a page for readers: docs/contract.md, from the descriptors and their comments.
//!
//! Enters: the compiled .proto files. Leaves: the text of the page, which a test compares with the committed one.

use std::{collections::BTreeMap, fmt::Write as _};

use prost::Message as _;
use prost_types::{
    DescriptorProto, EnumDescriptorProto, FieldDescriptorProto, FileDescriptorProto, FileDescriptorSet,
    MethodDescriptorProto, ServiceDescriptorProto,
    field_descriptor_proto::{Label, Type},
};

use crate::v1::FILE_DESCRIPTOR_SET;

/// Numbers of fields in `descriptor.proto`, of which the paths to comments are made.
const MESSAGES_OF_FILE: i32 = 4;
const ENUMS_OF_FILE: i32 = 5;
const SERVICES_OF_FILE: i32 = 6;
/// Fields of a message, values of an enum, methods of a service.
const PARTS: i32 = 2;

/// The package whose files are on the page.
const PACKAGE: &str = "nappe.v1";

const HEAD: &str = "\
# The contract

Package `nappe.v1`: every method, message and value, with its comment. [The service](service.md) tells how they are used, and
[the errors](errors.md) why a call can be refused. All quantities are in SI units. A field that is not set has its default: 0, an empty text,
`false`, or the enum's value 0; `optional` ones can be told from those that are not set.

This page is generated from the .proto files in `proto/nappe/v1`; a test compares them.
";

/// The page docs/contract.md.
///
/// # Panics
/// Never: the descriptors were written by the build of this crate.
pub fn contract_page() -> String {
    let set = FileDescriptorSet::decode(FILE_DESCRIPTOR_SET).expect("the build wrote them");
    let files: Vec<_> =
        set.file.iter().filter(|file| file.package() == PACKAGE).map(Described::new).collect();

    let mut page = HEAD.to_owned();
    for file in &files {
        for (i, service) in file.file.service.iter().enumerate() {
            page.push_str(&file.service(service, &[SERVICES_OF_FILE, i as i32]));
        }
    }

    let mut entries = BTreeMap::new();
    for file in &files {
        for (i, message) in file.file.message_type.iter().enumerate() {
            entries.insert(message.name(), file.message(message, &[MESSAGES_OF_FILE, i as i32]));
        }
        for (i, value) in file.file.enum_type.iter().enumerate() {
            entries.insert(value.name(), file.values(value, &[ENUMS_OF_FILE, i as i32]));
        }
    }
    page.push_str("\n## Messages and enums\n\nIn the order of their names.\n");
    page.extend(entries.into_values());
    page
}

/// A file with its comments by path.
struct Described<'a> {
    file: &'a FileDescriptorProto,
    comments: BTreeMap<&'a [i32], &'a str>,
}

impl<'a> Described<'a> {
    fn new(file: &'a FileDescriptorProto) -> Self {
        let locations = file.source_code_info.iter().flat_map(|info| &info.location);
        let comments = locations
            .filter(|location| location.leading_comments.is_some())
            .map(|location| (location.path.as_slice(), location.leading_comments()))
            .collect();
        Self { file, comments }
    }

    /// The comment at a path, in one line.
    fn comment(&self, path: &[i32]) -> String {
        let text = self.comments.get(path).copied().unwrap_or_default();
        text.split_whitespace().collect::<Vec<_>>().join(" ")
    }

    /// The comment of part `index` at a path, for a cell of a table.
    fn cell(&self, path: &[i32], index: usize) -> String {
        self.comment(&[path, &[PARTS, index as i32]].concat()).replace('|', "\\|")
    }

    fn service(&self, service: &ServiceDescriptorProto, path: &[i32]) -> String {
        let mut text = format!("\n## {}\n\n{}\n\n", service.name(), self.comment(path));
        text.push_str("| method | request | answer | |\n|---|---|---|---|\n");
        for (i, method) in service.method.iter().enumerate() {
            let (request, answer) = ends(method);
            writeln!(text, "| `{}` | {request} | {answer} | {} |", method.name(), self.cell(path, i))
                .expect("writing to a String succeeds");
        }
        text
    }

    fn message(&self, message: &DescriptorProto, path: &[i32]) -> String {
        let mut text = format!("\n### {}\n\n{}", message.name(), paragraph(&self.comment(path)));
        if message.field.is_empty() {
            text.push_str("It has no fields.\n");
            return text;
        }

        text.push_str("| field | number | type | |\n|---|---|---|---|\n");
        for (i, field) in message.field.iter().enumerate() {
            let (name, number, comment) = (field.name(), field.number(), self.cell(path, i));
            writeln!(text, "| `{name}` | {number} | {} | {comment} |", kind(message, field))
                .expect("writing to a String succeeds");
        }
        text
    }

    fn values(&self, value: &EnumDescriptorProto, path: &[i32]) -> String {
        let mut text = format!("\n### {}\n\n{}", value.name(), paragraph(&self.comment(path)));
        text.push_str("| value | number | |\n|---|---|---|\n");
        for (i, one) in value.value.iter().enumerate() {
            writeln!(text, "| `{}` | {} | {} |", one.name(), one.number(), self.cell(path, i))
                .expect("writing to a String succeeds");
        }
        text
    }
}

/// A comment and the empty line after it, if there is one.
fn paragraph(comment: &str) -> String {
    if comment.is_empty() { String::new() } else { format!("{comment}\n\n") }
}

/// Request and answer of a method, with what is a stream.
fn ends(method: &MethodDescriptorProto) -> (String, String) {
    let end = |name: &str, is_stream: bool| {
        let stream = if is_stream { "stream of " } else { "" };
        format!("{stream}{}", linked(name))
    };
    (
        end(method.input_type(), method.client_streaming()),
        end(method.output_type(), method.server_streaming()),
    )
}

/// What a field holds.
fn kind(message: &DescriptorProto, field: &FieldDescriptorProto) -> String {
    let kind = match field.r#type() {
        Type::Message | Type::Enum => linked(field.type_name()),
        other => format!("{other:?}").to_lowercase(),
    };
    if field.label() == Label::Repeated {
        return format!("repeated {kind}");
    }
    if field.proto3_optional() {
        return format!("optional {kind}");
    }
    match field.oneof_index.and_then(|index| message.oneof_decl.get(index as usize)) {
        Some(oneof) => format!("{kind}, one of `{}`", oneof.name()),
        None => kind,
    }
}

/// The name of a type, as a link to its entry if it is the contract's own.
fn linked(full_name: &str) -> String {
    let name = full_name.rsplit('.').next().unwrap_or(full_name);
    if full_name.strip_prefix('.').is_some_and(|full| full.starts_with(PACKAGE)) {
        return format!("[{name}](#{})", name.to_lowercase());
    }
    full_name.trim_start_matches('.').to_owned()
}
