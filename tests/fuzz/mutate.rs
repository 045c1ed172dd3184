//! Inputs from a number: mutated texts, mutated bytes, noise.

use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::{Rng, SeedableRng};

/// The random choices of one input.
pub struct Random(ChaCha8Rng);

impl Random {
    /// Those of the input of this number.
    pub fn new(input: u64) -> Self {
        Self(ChaCha8Rng::seed_from_u64(input))
    }

    /// A number below `end`, which may be 0 for an empty choice.
    pub fn below(&mut self, end: usize) -> usize {
        (self.0.next_u64() % end.max(1) as u64) as usize
    }

    /// One of these.
    pub fn of<'a, T: ?Sized>(&mut self, list: &[&'a T]) -> &'a T {
        list[self.below(list.len())]
    }

    /// So many random bytes.
    pub fn noise(&mut self, length: usize) -> Vec<u8> {
        (0..length).map(|_| self.0.next_u32() as u8).collect()
    }
}

/// Values that parsers and arithmetic stumble over.
const VALUES: [&str; 32] = [
    "0",
    "-1",
    "1e308",
    "1e-320",
    "-0.0",
    "nan",
    "inf",
    "-inf",
    "9223372036854775807",
    "-9223372036854775808",
    "18446744073709551616",
    "1e999",
    "0x7fffffff",
    "true",
    "\"\"",
    "\"saturated\"",
    "\"\\u0000\"",
    "[]",
    "{}",
    "[[[]]]",
    "1979-05-27T07:32:00Z",
    "\"DP\"",
    "\"SP\"",
    "[1.0, 1.0]",
    "{ from = 0.0, to = 1e300, points = 1000000 }",
    "{ from = 1.0, to = 1.0, points = 1 }",
    "{ from = -1, to = 1, points = 3, scale = \"log\" }",
    "4294967296",
    "1_000",
    "\"\"\"\n\"\"\"",
    "{ from = 0.1, to = 10.0, step = 1e-300 }",
    "1e15",
];

/// Marks that mean something in TOML.
const MARKS: [&str; 14] =
    ["[", "]", "{", "}", "=", "\n", ",", ".", "#", "\"", "'", "[[block]]\n", "[grid]\n", "\u{feff}"];

/// A campaign file: one of the corpus with some changes, two spliced, or noise.
pub fn campaign_text(corpus: &[String], random: &mut Random) -> String {
    if random.below(50) == 0 {
        let length = random.below(400);
        return String::from_utf8_lossy(&random.noise(length)).into_owned();
    }
    let mut text = corpus[random.below(corpus.len())].clone();
    for _ in 0..=random.below(5) {
        text = match random.below(8) {
            0..=2 => new_value(&text, random),
            3 => lines_moved(&text, random),
            4 => {
                let other = &corpus[random.below(corpus.len())];
                let (cut, from) = (place(&text, random), place(other, random));
                format!("{}{}", &text[..cut], &other[from..])
            }
            5 => {
                let at = place(&text, random);
                format!("{}{}{}", &text[..at], random.of(&MARKS), &text[at..])
            }
            _ => {
                let mut bytes = text.into_bytes();
                mutate(&mut bytes, random);
                String::from_utf8_lossy(&bytes).into_owned()
            }
        };
    }
    text
}

/// A place between two characters.
fn place(text: &str, random: &mut Random) -> usize {
    let mut at = random.below(text.len() + 1);
    while !text.is_char_boundary(at) {
        at -= 1;
    }
    at
}

/// Gives one key another value.
fn new_value(text: &str, random: &mut Random) -> String {
    let mut lines: Vec<String> = text.lines().map(str::to_owned).collect();
    let with_value: Vec<usize> = (0..lines.len()).filter(|&line| lines[line].contains('=')).collect();
    if with_value.is_empty() {
        return text.to_owned();
    }
    let line = with_value[random.below(with_value.len())];
    let key = lines[line].split('=').next().unwrap_or_default().to_owned();
    lines[line] = format!("{key}= {}", random.of(&VALUES));
    lines.join("\n")
}

/// Drops, doubles or moves a line.
fn lines_moved(text: &str, random: &mut Random) -> String {
    let mut lines: Vec<&str> = text.lines().collect();
    if lines.is_empty() {
        return String::new();
    }
    let (from, to) = (random.below(lines.len()), random.below(lines.len()));
    match random.below(3) {
        0 => drop(lines.remove(from)),
        1 => lines.insert(to, lines[from]),
        _ => lines.swap(from, to),
    }
    lines.join("\n")
}

/// Changes bytes: bits, numbers, pieces gone, doubled or moved.
pub fn mutate(bytes: &mut Vec<u8>, random: &mut Random) {
    for _ in 0..=random.below(4) {
        if bytes.is_empty() {
            *bytes = random.noise(16);
            return;
        }
        // Half of the changes hit the first bytes, where headers are.
        let reach = if random.below(2) == 0 { bytes.len().min(200) } else { bytes.len() };
        let at = random.below(reach);
        let end = (at + 1 + random.below(64)).min(bytes.len());
        match random.below(8) {
            0 | 1 => bytes[at] ^= 1 << random.below(8),
            2 => bytes[at] = [0, 1, 0x7F, 0x80, 0xFF][random.below(5)],
            3 => bytes[at..end].fill([0, 0xFF][random.below(2)]),
            4 => drop(bytes.drain(at..end)),
            5 => {
                let piece = bytes[at..end].to_vec();
                let to = random.below(bytes.len());
                bytes.splice(to..to, piece);
            }
            6 => bytes.truncate(at),
            _ => {
                let piece = random.noise(end - at);
                bytes[at..end].copy_from_slice(&piece);
            }
        }
    }
}
