//! A text at its commas, but for those within brackets, braces and quotes.

/// The parts of a text between commas, without blanks around them. Brackets, braces and quotes open where a part begins, and
/// within each other: `it's` is a text like others.
///
/// # Errors
/// What is opened and not closed, and parts without anything.
pub(super) fn parts(text: &str) -> Result<Vec<String>, String> {
    let (mut parts, mut part, mut is_escaped) = (Vec::new(), String::new(), false);
    // What closes the brackets, braces and quotes that are open.
    let mut open: Vec<char> = Vec::new();
    for letter in text.chars() {
        let can_open = !open.is_empty() || part.trim().is_empty();
        match (open.last().copied(), letter) {
            (None, ',') => {
                parts.push(std::mem::take(&mut part));
                continue;
            }
            (Some(quote @ ('"' | '\'')), _) => {
                if letter == quote && !is_escaped {
                    open.pop();
                }
                is_escaped = quote == '"' && letter == '\\' && !is_escaped;
            }
            (_, '"' | '\'') if can_open => open.push(letter),
            (_, '[') if can_open => open.push(']'),
            (_, '{') if can_open => open.push('}'),
            (Some(expected), ']' | '}') if letter == expected => {
                open.pop();
            }
            (Some(expected), ']' | '}') => {
                return Err(format!(
                    "'{text}' has {letter} where {expected} is needed to close what is open"
                ));
            }
            _ => {}
        }
        part.push(letter);
    }
    if let Some(expected) = open.last() {
        return Err(format!("'{text}' ends before {expected}, which closes what was opened"));
    }
    parts.push(part);
    let parts: Vec<String> = parts.iter().map(|part| part.trim().to_owned()).collect();
    if parts.iter().any(String::is_empty) {
        return Err(format!("'{text}' lacks a value beside a comma; an empty text is written \"\""));
    }
    Ok(parts)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn commas_within_brackets_braces_and_quotes_belong_to_a_value() {
        for (text, expected) in [
            ("1, 2,3", &["1", "2", "3"][..]),
            ("[1,0,0],[2,0,0]", &["[1,0,0]", "[2,0,0]"]),
            ("[\"a\"], [\"b,c\", 'd]']", &["[\"a\"]", "[\"b,c\", 'd]']"]),
            ("{ grid = [4, 4], spacing = 0.1 },x", &["{ grid = [4, 4], spacing = 0.1 }", "x"]),
            ("\"a,b\",'c,d'", &["\"a,b\"", "'c,d'"]),
            (r#""a\",b","\\",c"#, &[r#""a\",b""#, r#""\\""#, "c"]),
            ("it's,a[0,b}", &["it's", "a[0", "b}"]),
        ] {
            assert_eq!(parts(text).expect(text), expected);
        }
    }

    #[test]
    fn what_is_not_closed_or_missing_is_told() {
        for (text, part) in [
            ("[1,0,0", "ends before ]"),
            ("[[1,0],[2,0]", "ends before ]"),
            ("{ a = 1", "ends before }"),
            ("\"a,b", "ends before \""),
            ("[1,0}", "has } where ] is needed"),
            ("1,,2", "lacks a value"),
            ("1,", "lacks a value"),
        ] {
            let error = parts(text).expect_err(text);
            assert!(error.contains(part), "{text}: {error}");
        }
    }
}
