//! Tables of Markdown: every row has as many cells as its heading, so that a page shows what it says.
//!
//! A `|` inside a cell is written `\|`, in code as well: a cell ends at any other.

use crate::{
    assert_none,
    tree::{self, Source},
};

/// Cells of a row that begins and ends with `|`.
fn cells(row: &str) -> Vec<&str> {
    let row = row.trim();
    let mut found = Vec::new();
    let mut start = 0;
    let mut escaped = false;
    for (at, c) in row.char_indices() {
        if c == '|' && !escaped {
            found.push(row[start..at].trim());
            start = at + 1;
        }
        escaped = c == '\\' && !escaped;
    }
    // What stands after the last `|` is a cell of its own, unless nothing does.
    found.push(row[start..].trim());
    let ends = usize::from(found.last().is_some_and(|cell| cell.is_empty()));
    found[1..found.len() - ends].to_vec()
}

/// Whether a row separates the heading of a table from the rest: `|---|:--|`.
fn is_ruler(row: &str) -> bool {
    cells(row).iter().all(|cell| cell.contains('-') && cell.chars().all(|c| c == '-' || c == ':'))
}

/// Complaints about the tables of a page.
fn against_tables(page: &Source) -> Vec<String> {
    let mut complaints = Vec::new();
    let mut in_code = false;
    let mut table: Option<usize> = None;
    let lines: Vec<&str> = page.text.lines().collect();
    for (index, line) in lines.iter().enumerate() {
        if line.trim_start().starts_with("```") {
            in_code = !in_code;
        }
        if in_code || !line.starts_with('|') {
            table = None;
            continue;
        }
        let count = cells(line).len();
        let place = format!("{}:{}", page.path, index + 1);
        match table {
            None if !lines.get(index + 1).is_some_and(|next| next.starts_with('|') && is_ruler(next)) => {
                complaints.push(format!("{place}: a heading without `|---|` below it"));
            }
            Some(wanted) if count != wanted => {
                complaints.push(format!("{place}: {count} cells under a heading of {wanted}: {line}"));
            }
            _ => {}
        }
        table = table.or(Some(count));
    }
    complaints
}

#[test]
fn every_row_of_a_table_has_the_cells_of_its_heading() {
    let pages = tree::sources(|path| tree::has_extension(path, "md"));
    let tables = pages.iter().filter(|page| page.text.lines().any(|line| line.starts_with("|---")));
    assert!(tables.count() > 5, "pages have tables");
    assert_none(&pages.iter().flat_map(against_tables).collect::<Vec<_>>());
}

#[test]
fn the_rule_finds_what_it_is_for() {
    let of = |text: &str| against_tables(&Source::example("x.md", text));
    assert_none(&of("| a | b |\n|---|:-:|\n| 1 | `x \\| y` |\n| | |\n\nx | y\n```\n| a |\n```\n"));
    assert_eq!(of("| a | b |\n|---|---|\n| 1 | `x | y` |\n").len(), 1);
    assert_eq!(of("| a | b |\n|---|---|\n| 1 |\n").len(), 1);
    assert_eq!(of("| a | b |\n|---|\n").len(), 1);
    assert_eq!(of("text\n| a | b |\n| 1 | 2 |\n").len(), 1);
}
