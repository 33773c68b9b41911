//! Fields as bytes: three numbers per vector, the lowest byte of each first.

use std::fmt;

use serde::{Deserializer, Serializer, de};

use super::{LANES, Padded, Real, Sixteen, Vec3};

/// What has a fixed number of bytes.
pub(crate) trait Bytes: Sized {
    /// How many bytes a value has.
    const BYTES: usize;
    /// Adds the bytes of this value.
    fn write(&self, bytes: &mut Vec<u8>);
    /// What as many bytes stand for.
    fn read(bytes: &[u8]) -> Self;
}

impl<R: Real> Bytes for Padded<R> {
    const BYTES: usize = 3 * R::BYTES;

    fn write(&self, bytes: &mut Vec<u8>) {
        self.vector().iter().for_each(|c| c.write(bytes));
    }

    fn read(bytes: &[u8]) -> Self {
        let number = |c: usize| R::read(&bytes[c * R::BYTES..(c + 1) * R::BYTES]);
        Self::new(&Vec3::new(number(0), number(1), number(2)))
    }
}

impl<R: Real> Bytes for Sixteen<R> {
    const BYTES: usize = LANES * <Padded<R> as Bytes>::BYTES;

    fn write(&self, bytes: &mut Vec<u8>) {
        (0..LANES).for_each(|lane| Padded::new(&self.get(lane)).write(bytes));
    }

    fn read(bytes: &[u8]) -> Self {
        let mut sixteen = Self::default();
        for (lane, bytes) in bytes.chunks_exact(<Padded<R> as Bytes>::BYTES).enumerate() {
            sixteen.set(lane, Padded::read(bytes).vector());
        }
        sixteen
    }
}

/// Writes a field in one piece.
pub(crate) fn serialize<T: Bytes, S: Serializer>(field: &[T], serializer: S) -> Result<S::Ok, S::Error> {
    let mut bytes = Vec::with_capacity(field.len() * T::BYTES);
    for value in field {
        value.write(&mut bytes);
    }
    serializer.serialize_bytes(&bytes)
}

/// Reads a field that was written so.
pub(crate) fn deserialize<'de, T: Bytes, D: Deserializer<'de>>(deserializer: D) -> Result<Vec<T>, D::Error> {
    deserializer.deserialize_bytes(Visitor(std::marker::PhantomData))
}

struct Visitor<T>(std::marker::PhantomData<T>);

impl<T: Bytes> de::Visitor<'_> for Visitor<T> {
    type Value = Vec<T>;

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "a multiple of {} bytes", T::BYTES)
    }

    fn visit_bytes<E: de::Error>(self, bytes: &[u8]) -> Result<Vec<T>, E> {
        if !bytes.len().is_multiple_of(T::BYTES) {
            return Err(E::invalid_length(bytes.len(), &self));
        }
        Ok(bytes.chunks_exact(T::BYTES).map(T::read).collect())
    }
}
