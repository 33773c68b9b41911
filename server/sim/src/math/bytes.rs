//! Fields as bytes: three numbers per vector, the lowest byte of each first.

use std::fmt;

use serde::{Deserializer, Serializer, de};

use super::{LANES, Padded, Real, Sixteen, Vec3};

/// What has a fixed number of bytes.
pub(crate) trait Bytes: Sized {
    /// How many bytes a value has.
    const BYTES: usize;
    /// Writes the bytes of this value to as many.
    fn write(&self, bytes: &mut [u8]);
    /// What as many bytes stand for.
    fn read(bytes: &[u8]) -> Self;
}

impl<R: Real> Bytes for Padded<R> {
    const BYTES: usize = 3 * R::BYTES;

    #[inline(always)]
    fn write(&self, bytes: &mut [u8]) {
        for (c, bytes) in bytes.chunks_exact_mut(R::BYTES).enumerate() {
            self.0[c].write(bytes);
        }
    }

    #[inline(always)]
    fn read(bytes: &[u8]) -> Self {
        let number = |c: usize| R::read(&bytes[c * R::BYTES..(c + 1) * R::BYTES]);
        Self::new(&Vec3::new(number(0), number(1), number(2)))
    }
}

impl<R: Real> Bytes for Sixteen<R> {
    const BYTES: usize = LANES * <Padded<R> as Bytes>::BYTES;

    fn write(&self, bytes: &mut [u8]) {
        for (lane, bytes) in bytes.chunks_exact_mut(<Padded<R> as Bytes>::BYTES).enumerate() {
            Padded::new(&self.get(lane)).write(bytes);
        }
    }

    fn read(bytes: &[u8]) -> Self {
        let mut sixteen = Self::default();
        for (lane, bytes) in bytes.chunks_exact(<Padded<R> as Bytes>::BYTES).enumerate() {
            sixteen.set(lane, Padded::read(bytes).vector());
        }
        sixteen
    }
}

/// Adds the bytes of values.
pub(crate) fn append<'a, T: Bytes + 'a>(values: impl ExactSizeIterator<Item = &'a T>, bytes: &mut Vec<u8>) {
    let start = bytes.len();
    bytes.resize(start + values.len() * T::BYTES, 0);
    for (value, bytes) in values.zip(bytes[start..].chunks_exact_mut(T::BYTES)) {
        value.write(bytes);
    }
}

/// Writes a field in one piece.
pub(crate) fn serialize<T: Bytes, S: Serializer>(field: &[T], serializer: S) -> Result<S::Ok, S::Error> {
    let mut bytes = Vec::new();
    append(field.iter(), &mut bytes);
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

/// Bytes as they are, in one piece.
pub(crate) mod raw {
    use std::fmt;

    use serde::{Deserializer, Serializer, de};

    pub(crate) fn serialize<S: Serializer>(bytes: &[u8], serializer: S) -> Result<S::Ok, S::Error> {
        serializer.serialize_bytes(bytes)
    }

    pub(crate) fn deserialize<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Vec<u8>, D::Error> {
        deserializer.deserialize_byte_buf(Visitor)
    }

    struct Visitor;

    impl de::Visitor<'_> for Visitor {
        type Value = Vec<u8>;

        fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
            f.write_str("bytes")
        }

        fn visit_bytes<E: de::Error>(self, bytes: &[u8]) -> Result<Vec<u8>, E> {
            Ok(bytes.to_vec())
        }

        fn visit_byte_buf<E: de::Error>(self, bytes: Vec<u8>) -> Result<Vec<u8>, E> {
            Ok(bytes)
        }
    }
}
