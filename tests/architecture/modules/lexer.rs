//! Python and TypeScript as words, strings and signs; comments are left out.
//!
//! A regular expression of TypeScript is not known as one: a quote in it begins a string, which ends with its line.

/// A language, which says what comments and strings look like.
#[derive(Clone, Copy, Debug)]
pub(super) enum Language {
    /// `#` begins a comment; strings have one quote or three.
    Python,
    /// `//` and `/*` begin a comment; a string in backquotes may have several lines.
    TypeScript,
}

/// A piece of a text that is neither blank nor a comment.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Token<'a> {
    /// A name, a keyword or a number.
    Word(&'a str),
    /// What stands between quotes, as it is written.
    Quoted(&'a str),
    /// Any other character, and the end of a line.
    Sign(char),
}

/// The tokens of a text, in order.
pub(super) fn tokens(text: &str, language: Language) -> Vec<Token<'_>> {
    let mut found = Vec::new();
    let mut rest = text;
    while let Some(first) = rest.chars().next() {
        let (length, token) = piece(rest, first, language);
        found.extend(token);
        rest = &rest[length..];
    }
    found
}

/// The length of what `rest` begins with (bytes), and its token; comments, blanks and continued lines have none.
fn piece(rest: &str, first: char, language: Language) -> (usize, Option<Token<'_>>) {
    const CONTINUED: &str = "\\\n";
    if rest.starts_with(CONTINUED) {
        return (CONTINUED.len(), None);
    }
    if let Some(length) = comment(rest, language) {
        return (length, None);
    }
    if let Some(quotes) = quotes(rest, language) {
        let (inside, length) = quoted(rest, quotes);
        return (length, Some(Token::Quoted(inside)));
    }
    if is_of_word(first) {
        let length = rest.find(|c| !is_of_word(c)).unwrap_or(rest.len());
        return (length, Some(Token::Word(&rest[..length])));
    }
    let is_sign = first == '\n' || !first.is_whitespace();
    (first.len_utf8(), is_sign.then_some(Token::Sign(first)))
}

fn is_of_word(c: char) -> bool {
    c.is_alphanumeric() || c == '_' || c == '$'
}

/// The length of the comment with which `rest` begins (bytes); the end of its line is no part of it.
fn comment(rest: &str, language: Language) -> Option<usize> {
    let line = || rest.find('\n').unwrap_or(rest.len());
    match language {
        Language::Python => rest.starts_with('#').then(line),
        Language::TypeScript if rest.starts_with("//") => Some(line()),
        Language::TypeScript => {
            let inside = rest.strip_prefix("/*")?;
            Some(inside.find("*/").map_or(rest.len(), |end| end + "/**/".len()))
        }
    }
}

/// The quotes with which `rest` begins.
fn quotes(rest: &str, language: Language) -> Option<&'static str> {
    let known: &[&'static str] = match language {
        Language::Python => &["\"\"\"", "'''", "\"", "'"],
        Language::TypeScript => &["\"", "'", "`"],
    };
    known.iter().copied().find(|quotes| rest.starts_with(*quotes))
}

/// What stands between the quotes with which `rest` begins, and its length with them (bytes).
fn quoted<'a>(rest: &'a str, quotes: &str) -> (&'a str, usize) {
    let ends_with_line = matches!(quotes, "\"" | "'");
    let mut is_escaped = false;
    for (at, c) in rest.char_indices().skip_while(|(at, _)| *at < quotes.len()) {
        if is_escaped {
            is_escaped = false;
        } else if c == '\\' {
            is_escaped = true;
        } else if rest[at..].starts_with(quotes) {
            return (&rest[quotes.len()..at], at + quotes.len());
        } else if c == '\n' && ends_with_line {
            return (&rest[quotes.len()..at], at);
        }
    }
    (&rest[quotes.len()..], rest.len())
}

#[test]
fn comments_are_left_out_and_strings_are_whole() {
    use Token::{Quoted, Sign, Word};

    let python = "a # 'b'\n\"\"\"c\n\"d\" \\\"\"\" #\"\"\" e('#f\\'', \"\") \\\ng";
    let wanted = [
        Word("a"),
        Sign('\n'),
        Quoted("c\n\"d\" \\\"\"\" #"),
        Word("e"),
        Sign('('),
        Quoted("#f\\'"),
        Sign(','),
        Quoted(""),
        Sign(')'),
        Word("g"),
    ];
    assert_eq!(tokens(python, Language::Python), wanted);

    let typescript = "$a /* 'b'\n*/ '//c' // d\n`e\n'` /['] /\nf \"/* g";
    let wanted = [
        Word("$a"),
        Quoted("//c"),
        Sign('\n'),
        Quoted("e\n'"),
        Sign('/'),
        Sign('['),
        Quoted("] /"),
        Sign('\n'),
        Word("f"),
        Quoted("/* g"),
    ];
    assert_eq!(tokens(typescript, Language::TypeScript), wanted);
}
