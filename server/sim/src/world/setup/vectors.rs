//! Vectors that a change has for the particles of a body: its own list, or one that others have too.

use std::{
    fmt,
    ops::{Deref, Range},
    sync::Arc,
};

use serde::{Deserialize, Deserializer, Serialize, Serializer};

/// Vectors, one for each particle. They stay where they are, in whatever they were made from: a copy refers to the same ones.
#[derive(Clone)]
pub struct Vectors {
    owner: Arc<dyn AsRef<[[f64; 3]]> + Send + Sync>,
    /// Bytes that nobody else counts.
    bytes: usize,
}

impl Vectors {
    /// Vectors whose memory somebody else counts for as long as they are there.
    pub fn counted_elsewhere(owner: impl AsRef<[[f64; 3]]> + Send + Sync + 'static) -> Self {
        Self { owner: Arc::new(owner), bytes: 0 }
    }

    /// Memory that is theirs to count (bytes): none where somebody else counts it.
    pub fn bytes(&self) -> usize {
        self.bytes
    }
}

/// Some of the vectors that others have.
struct Part {
    whole: Vectors,
    range: Range<usize>,
}

impl AsRef<[[f64; 3]]> for Part {
    fn as_ref(&self) -> &[[f64; 3]] {
        &self.whole[self.range.clone()]
    }
}

impl Vectors {
    /// Those of a range, without a copy.
    pub(crate) fn part(&self, range: Range<usize>) -> Self {
        Self::from(Part { whole: self.clone(), range })
    }
}

impl<T: AsRef<[[f64; 3]]> + Send + Sync + 'static> From<T> for Vectors {
    fn from(owner: T) -> Self {
        let bytes = size_of_val(owner.as_ref());
        Self { owner: Arc::new(owner), bytes }
    }
}

impl Deref for Vectors {
    type Target = [[f64; 3]];

    fn deref(&self) -> &Self::Target {
        (*self.owner).as_ref()
    }
}

impl fmt::Debug for Vectors {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        fmt::Debug::fmt(&**self, f)
    }
}

impl PartialEq for Vectors {
    fn eq(&self, other: &Self) -> bool {
        **self == **other
    }
}

impl Serialize for Vectors {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        (**self).serialize(serializer)
    }
}

/// Whoever gets them has a list of its own.
impl<'de> Deserialize<'de> for Vectors {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        Vec::<[f64; 3]>::deserialize(deserializer).map(Self::from)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_copy_refers_to_the_same_vectors() {
        let own = Vectors::from(vec![[1.0, 2.0, 3.0]; 2]);
        let copy = own.clone();
        assert_eq!(own.as_ptr(), copy.as_ptr());
        assert_eq!((own.bytes(), Vectors::counted_elsewhere(vec![[0.0; 3]; 2]).bytes()), (48, 0));
        assert!(own == Vectors::from([[1.0, 2.0, 3.0]; 2]) && own != Vectors::from([[1.0, 2.0, 4.0]; 2]));
        let part = own.part(1..2);
        assert_eq!((part.as_ptr(), part.len()), (own[1..].as_ptr(), 1));
    }
}
