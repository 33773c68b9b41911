//! A picture, as it leaves this crate.

/// A picture of a chart.
#[derive(Clone, Debug)]
pub struct Picture {
    /// Its name, without extension.
    pub name: &'static str,
    /// As a vector graphic.
    pub svg: String,
    /// As pixels, two for each of the vector graphic.
    pub png: Vec<u8>,
    /// What it shows, in a sentence.
    pub sentence: String,
}
