//! What one parameter is: its name and meaning, the values it may have, and where a [`Point`] keeps it.

use crate::parameters::{Density, Interval, Point};

/// A value of a parameter.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Value {
    /// A number.
    Number(f64),
    /// A word, such as `verlet`, `saturated` or `none`.
    Word(&'static str),
}

/// The values that a key may have.
#[derive(Clone, Copy, Debug)]
pub enum Domain {
    /// Any text.
    Text,
    /// One of these words.
    Choice(&'static [&'static str]),
    /// A number in the interval.
    Number(Interval),
    /// A number in the interval, or this word.
    NumberOr(Interval, &'static str),
    /// A whole number in the interval.
    Whole(Interval),
    /// A whole number in the interval, or this word.
    WholeOr(Interval, &'static str),
}

/// Which grid points have a parameter.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Applies {
    /// All.
    Always,
    /// Those of this model.
    Model(&'static str),
    /// Those in this scene.
    Scene(&'static str),
}

/// One parameter of a grid point. A parameter whose range or meaning depends on model or scene has several rows.
#[derive(Clone, Copy, Debug)]
pub struct Parameter {
    /// Its name: the key of campaign files, the column of `runs`, the word in captions and tables.
    pub name: &'static str,
    /// What it is, in one line.
    pub about: &'static str,
    /// Its unit; empty for words and pure numbers.
    pub unit: &'static str,
    /// Which grid points have it.
    pub applies: Applies,
    /// The values that campaign files may give it.
    pub domain: Domain,
    /// Its value in a campaign file that leaves it out; `None` if it must be given.
    pub default: Option<Value>,
    /// What the value `auto` means; empty if the parameter has no such value.
    pub auto: &'static str,
    /// The parameter of which this one is another form: `bond` stands for `gamma`. A point keeps only that parameter.
    pub instead_of: Option<&'static str>,
    /// Whether campaign files write it under `[limits]`, rather than at the top.
    pub is_limit: bool,
    /// Whether captions name it.
    pub in_captions: bool,
    /// How it is read from a point and written into one.
    pub(super) field: Field,
}

#[derive(Clone, Copy, Debug)]
pub(super) struct Field {
    pub(super) get: fn(&Point) -> Option<Value>,
    pub(super) set: fn(&mut Point, Value),
}

/// The type of a field of a point that holds a parameter.
pub(super) trait Held: Sized {
    fn value(&self) -> Value;

    /// `None` if the type cannot hold the value.
    fn of(value: Value) -> Option<Self>;

    fn put(&mut self, value: Value) {
        if let Some(held) = Self::of(value) {
            *self = held;
        }
    }
}

impl Held for f64 {
    fn value(&self) -> Value {
        Value::Number(*self)
    }

    fn of(value: Value) -> Option<Self> {
        value.number()
    }
}

impl Held for usize {
    fn value(&self) -> Value {
        Value::Number(*self as f64)
    }

    fn of(value: Value) -> Option<Self> {
        value.number().map(|number| number as Self)
    }
}

/// `None` is the word `none`.
impl Held for Option<f64> {
    fn value(&self) -> Value {
        self.map_or(Value::Word("none"), Value::Number)
    }

    fn of(value: Value) -> Option<Self> {
        Some(value.number())
    }
}

impl Held for Density {
    fn value(&self) -> Value {
        match self {
            Self::Saturated => Value::Word("saturated"),
            Self::Number(density) => Value::Number(*density),
        }
    }

    fn of(value: Value) -> Option<Self> {
        Some(value.number().map_or(Self::Saturated, Self::Number))
    }
}

impl Value {
    /// The number, if it is one.
    pub fn number(self) -> Option<f64> {
        match self {
            Self::Number(number) => Some(number),
            Self::Word(_) => None,
        }
    }

    /// The word, if it is one.
    pub fn word(self) -> Option<&'static str> {
        match self {
            Self::Number(_) => None,
            Self::Word(word) => Some(word),
        }
    }
}

impl Domain {
    /// The allowed values in words, as they follow "must be".
    pub fn allowed(&self) -> String {
        match self {
            Self::Text => "a text in quotes".to_owned(),
            Self::Choice(words) => alternatives(words),
            Self::Number(interval) => format!("a number {interval}"),
            Self::NumberOr(interval, word) => format!("a number {interval}, or \"{word}\""),
            Self::Whole(interval) => format!("a whole number {interval}"),
            Self::WholeOr(interval, word) => format!("a whole number {interval}, or \"{word}\""),
        }
    }

    /// The number, if it is allowed. Minus zero becomes zero: it is the same number, and must not give a job two
    /// identities.
    pub fn number(&self, number: f64) -> Option<f64> {
        let number = number + 0.0;
        match self {
            Self::Number(interval) | Self::NumberOr(interval, _) => interval.contains(number).then_some(number),
            Self::Whole(interval) | Self::WholeOr(interval, _) => {
                (number == number.round() && interval.contains(number)).then_some(number)
            }
            Self::Text | Self::Choice(_) => None,
        }
    }

    /// The words that are allowed.
    pub fn words(&self) -> &[&'static str] {
        match self {
            Self::Choice(words) => words,
            Self::NumberOr(_, word) | Self::WholeOr(_, word) => std::slice::from_ref(word),
            Self::Text | Self::Number(_) | Self::Whole(_) => &[],
        }
    }

    /// The word, if it is allowed.
    pub fn word(&self, text: &str) -> Option<&'static str> {
        self.words().iter().copied().find(|word| *word == text)
    }
}

fn alternatives(words: &[&str]) -> String {
    match words {
        [] => String::new(),
        [word] => format!("\"{word}\""),
        [first, last] => format!("\"{first}\" or \"{last}\""),
        [first, rest @ ..] => format!("\"{first}\", {}", alternatives(rest)),
    }
}

impl Applies {
    /// Whether a point of this model in this scene has the parameter.
    pub fn to(self, model: &str, scene: &str) -> bool {
        match self {
            Self::Always => true,
            Self::Model(name) => name == model,
            Self::Scene(name) => name == scene,
        }
    }
}

impl Parameter {
    /// Whether the value is an `auto` that the campaign replaces.
    pub(crate) fn is_open(&self, value: Value) -> bool {
        !self.auto.is_empty() && value == Value::Word("auto")
    }

    /// Its value at a point; `None` if the point does not have it.
    pub fn get(&self, point: &Point) -> Option<Value> {
        (self.field.get)(point)
    }

    /// Writes it into a point. Nothing happens if the point does not have the parameter or cannot hold such a value.
    pub fn set(&self, point: &mut Point, value: Value) {
        (self.field.set)(point, value);
    }
}

/// A row of the list that is required and has no domain yet; the methods below complete it.
pub(super) const fn parameter(name: &'static str, about: &'static str, field: Field) -> Parameter {
    Parameter {
        name,
        about,
        unit: "",
        applies: Applies::Always,
        domain: Domain::Text,
        default: None,
        auto: "",
        instead_of: None,
        is_limit: false,
        in_captions: false,
        field,
    }
}

impl Parameter {
    pub(super) const fn of(self, applies: Applies) -> Self {
        Self { applies, ..self }
    }

    pub(super) const fn number(self, interval: Interval) -> Self {
        Self { domain: Domain::Number(interval), ..self }
    }

    pub(super) const fn number_or(self, word: &'static str, interval: Interval) -> Self {
        Self { domain: Domain::NumberOr(interval, word), ..self }
    }

    pub(super) const fn whole_or(self, word: &'static str, interval: Interval) -> Self {
        Self { domain: Domain::WholeOr(interval, word), ..self }
    }

    pub(super) const fn choice(self, words: &'static [&'static str]) -> Self {
        Self { domain: Domain::Choice(words), default: Some(Value::Word(words[0])), ..self }
    }

    pub(super) const fn required(self) -> Self {
        Self { default: None, ..self }
    }

    pub(super) const fn default(self, number: f64) -> Self {
        Self { default: Some(Value::Number(number)), ..self }
    }

    pub(super) const fn default_to(self, word: &'static str) -> Self {
        Self { default: Some(Value::Word(word)), ..self }
    }

    /// `auto` is the default and means this.
    pub(super) const fn auto(self, meaning: &'static str) -> Self {
        Self { auto: meaning, ..self }.default_to("auto")
    }

    pub(super) const fn unit(self, unit: &'static str) -> Self {
        Self { unit, ..self }
    }

    pub(super) const fn instead_of(self, name: &'static str) -> Self {
        Self { instead_of: Some(name), ..self }
    }

    pub(super) const fn limit(self) -> Self {
        Self { is_limit: true, ..self }
    }

    pub(super) const fn caption(self) -> Self {
        Self { in_captions: true, ..self }
    }
}
