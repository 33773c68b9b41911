//! Files that were damaged: bits turned, ends cut, lines moved, numbers put in place of others.

use fastrand::Rng;

/// A way to damage a file.
type Mutation = fn(&mut Rng, &mut Vec<u8>);

const MUTATIONS: [Mutation; 11] = [
    turn_bit,
    put_byte,
    cut,
    repeat_line,
    remove_line,
    swap_lines,
    replace_number,
    insert_bytes,
    insert_words,
    repeat_part,
    change_line_ends,
];

/// Numbers that no file should hold, or that do not fit where they stand.
const NUMBERS: [&str; 14] = [
    "999999999999",
    "4294967295",
    "18446744073709551616",
    "-1",
    "-0",
    "0",
    "1",
    "nan",
    "-inf",
    "1e999",
    "-1e308",
    "1e-320",
    "1.5",
    "0x10",
];

/// Words that mean something to a reader.
const WORDS: [&str; 11] = [
    "\n",
    "#",
    "/",
    "\u{fffd}",
    "\u{a0}",
    "\u{b}",
    "f 1 1 1 1 1 1 1\n",
    "vt 0 0\n",
    "element vertex 4000000000\n",
    "property list uchar int v\n",
    "end_header\n",
];

/// Damages a file in up to four ways; one file in five stays as it is.
pub(crate) fn damage(random: &mut Rng, bytes: &mut Vec<u8>) {
    for _ in 0..random.usize(0..5) {
        MUTATIONS[random.usize(0..MUTATIONS.len())](random, bytes);
    }
}

/// A place in a file, its end included.
fn place(random: &mut Rng, bytes: &[u8]) -> usize {
    random.usize(0..=bytes.len())
}

#[allow(clippy::ptr_arg, reason = "one signature for every mutation")]
fn turn_bit(random: &mut Rng, bytes: &mut Vec<u8>) {
    let at = place(random, bytes);
    if let Some(byte) = bytes.get_mut(at) {
        *byte ^= 1 << random.u8(0..8);
    }
}

#[allow(clippy::ptr_arg, reason = "one signature for every mutation")]
fn put_byte(random: &mut Rng, bytes: &mut Vec<u8>) {
    let at = place(random, bytes);
    if let Some(byte) = bytes.get_mut(at) {
        *byte = random.u8(..);
    }
}

fn cut(random: &mut Rng, bytes: &mut Vec<u8>) {
    let at = place(random, bytes);
    bytes.truncate(at);
}

/// Has the lines of a file changed by `change`, which gets two of their numbers. A binary part is a line too.
fn on_lines(random: &mut Rng, bytes: &mut Vec<u8>, change: impl Fn(&mut Vec<&[u8]>, [usize; 2])) {
    let mut lines: Vec<&[u8]> = bytes.split_inclusive(|byte| *byte == b'\n').collect();
    if lines.is_empty() {
        return;
    }
    let chosen = [0; 2].map(|_| random.usize(0..lines.len()));
    change(&mut lines, chosen);
    *bytes = lines.concat();
}

fn repeat_line(random: &mut Rng, bytes: &mut Vec<u8>) {
    on_lines(random, bytes, |lines, [from, to]| lines.insert(to, lines[from]));
}

fn remove_line(random: &mut Rng, bytes: &mut Vec<u8>) {
    on_lines(random, bytes, |lines, [line, _]| {
        lines.remove(line);
    });
}

fn swap_lines(random: &mut Rng, bytes: &mut Vec<u8>) {
    on_lines(random, bytes, |lines, [a, b]| lines.swap(a, b));
}

/// Puts another number in place of the first one after some place.
fn replace_number(random: &mut Rng, bytes: &mut Vec<u8>) {
    let is_of_number = |byte: &u8| byte.is_ascii_digit() || matches!(byte, b'-' | b'+' | b'.' | b'e');
    let at = place(random, bytes);
    let Some(start) = bytes[at..].iter().position(u8::is_ascii_digit).map(|offset| at + offset) else {
        return;
    };
    let end = bytes[start..].iter().position(|byte| !is_of_number(byte)).map_or(bytes.len(), |n| start + n);
    let number = NUMBERS[random.usize(0..NUMBERS.len())];
    drop(bytes.splice(start..end, number.bytes()));
}

fn insert_bytes(random: &mut Rng, bytes: &mut Vec<u8>) {
    let at = place(random, bytes);
    let new: Vec<u8> = (0..random.usize(1..20)).map(|_| random.u8(..)).collect();
    drop(bytes.splice(at..at, new));
}

fn insert_words(random: &mut Rng, bytes: &mut Vec<u8>) {
    let at = place(random, bytes);
    drop(bytes.splice(at..at, WORDS[random.usize(0..WORDS.len())].bytes()));
}

fn repeat_part(random: &mut Rng, bytes: &mut Vec<u8>) {
    let at = place(random, bytes);
    let end = (at + random.usize(0..200)).min(bytes.len());
    let part = bytes[at..end].to_vec();
    let length = random.usize(0..2000).min(50 * part.len());
    drop(bytes.splice(at..at, part.into_iter().cycle().take(length)));
}

/// Ends lines as another system does, or did.
fn change_line_ends(random: &mut Rng, bytes: &mut Vec<u8>) {
    let end: &[u8] = if random.bool() { b"\r" } else { b"\r\n" };
    *bytes = bytes.split(|byte| *byte == b'\n').collect::<Vec<_>>().join(end);
}
