//! Counts the elements of a request while its bytes arrive, before they become memory: an empty element takes two
//! bytes of a message, and some hundred once it is decoded.
//!
//! Enters: the bytes of a call's requests, in any division. Leaves: whether they may be decoded. Which fields repeat is
//! known from the contract's descriptors.

use std::{
    collections::{BTreeMap, HashMap},
    sync::LazyLock,
};

use nappe_proto::v1::FILE_DESCRIPTOR_SET;
use prost::Message as _;
use prost_types::{
    FileDescriptorSet,
    field_descriptor_proto::{Label, Type},
};

/// Bytes before a message: whether it is compressed, and its length.
const PREFIX_BYTES: usize = 5;
/// Messages within messages at most, as the decoder allows.
const MAX_DEPTH: usize = 100;

/// Why a request may not be decoded.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Fault {
    /// It has more elements than are allowed.
    TooMany,
    /// It announces a message of more bytes than are allowed.
    TooLong,
    /// It is not a message of the contract.
    Malformed,
}

/// What a field of a message holds, as far as elements are concerned.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Shape {
    /// A message, by its place in the list.
    Message(usize),
    /// Whole numbers, booleans or values of an enum: several may stand together.
    Whole,
    /// Anything else: its bytes are its memory.
    Other,
}

/// A field, and whether it repeats.
#[derive(Clone, Copy, Debug)]
struct Field {
    shape: Shape,
    repeats: bool,
}

/// The contract: methods by their paths, messages by their places.
#[derive(Debug, Default)]
struct Contract {
    methods: HashMap<String, usize>,
    messages: Vec<BTreeMap<u64, Field>>,
}

static CONTRACT: LazyLock<Contract> = LazyLock::new(Contract::read);

impl Contract {
    fn read() -> Self {
        let set =
            FileDescriptorSet::decode(FILE_DESCRIPTOR_SET).expect("the descriptors were made by the build");
        let packages = || set.file.iter().map(|file| (file.package(), file));
        let named = packages().flat_map(|(package, file)| {
            file.message_type.iter().map(move |message| (format!(".{package}.{}", message.name()), message))
        });
        let places: HashMap<String, usize> =
            named.clone().enumerate().map(|(place, (name, _))| (name, place)).collect();

        let messages = named.map(|(_, message)| {
            let fields = message.field.iter().map(|field| {
                let shape = match field.r#type() {
                    Type::Message => {
                        places.get(field.type_name()).map_or(Shape::Other, |at| Shape::Message(*at))
                    }
                    Type::Double
                    | Type::Float
                    | Type::Fixed64
                    | Type::Fixed32
                    | Type::Sfixed64
                    | Type::Sfixed32
                    | Type::String
                    | Type::Bytes
                    | Type::Group => Shape::Other,
                    _ => Shape::Whole,
                };
                let repeats = field.label() == Label::Repeated;
                (u64::from(field.number().unsigned_abs()), Field { shape, repeats })
            });
            fields.collect()
        });

        let services = packages().flat_map(|(package, file)| file.service.iter().map(move |s| (package, s)));
        let methods = services.flat_map(|(package, service)| {
            let place = |method: &prost_types::MethodDescriptorProto| {
                let path = format!("/{package}.{}/{}", service.name(), method.name());
                places.get(method.input_type()).map(|place| (path, *place))
            };
            service.method.iter().filter_map(place).collect::<Vec<_>>()
        });
        Self { methods: methods.collect(), messages: messages.collect() }
    }
}

/// A number of the wire that comes byte by byte.
#[derive(Clone, Copy, Debug, Default)]
struct Varint {
    value: u64,
    bits: u32,
}

impl Varint {
    /// The number, once its last byte has come.
    fn push(&mut self, byte: u8) -> Result<Option<u64>, Fault> {
        if self.bits > 63 {
            return Err(Fault::Malformed);
        }
        self.value |= u64::from(byte & 0x7F) << self.bits;
        self.bits += 7;
        Ok((byte < 0x80).then_some(self.value))
    }
}

/// What the next byte belongs to.
#[derive(Clone, Copy, Debug)]
enum State {
    /// The prefix of a message, of which some bytes have come.
    Prefix([u8; PREFIX_BYTES], usize),
    /// The number and kind of a field.
    Key(Varint),
    /// A number, whatever it is.
    Value(Varint),
    /// The length of a field.
    Length(Field, Varint),
    /// Bytes that are no elements.
    Skip(u64),
    /// Whole numbers, one after the other, in so many bytes.
    Packed(u64),
}

/// Counts the elements of the requests of one call.
#[derive(Debug)]
pub(super) struct ElementCounter {
    /// Elements of one message at most.
    allowed: u64,
    /// Bytes of one message at most.
    longest: u64,
    /// The message of the method.
    root: usize,
    state: State,
    /// Messages that are open: their places, and where they end.
    open: Vec<(usize, u64)>,
    /// Bytes of the message that were read.
    at: u64,
    count: u64,
}

impl ElementCounter {
    /// A counter for a method of the contract; none for others.
    pub(super) fn of(path: &str, allowed: u64) -> Option<Self> {
        let root = *CONTRACT.methods.get(path)?;
        let state = State::Prefix([0; PREFIX_BYTES], 0);
        Some(Self { allowed, longest: u64::MAX, root, state, open: Vec::new(), at: 0, count: 0 })
    }

    /// The same for messages of so many bytes at most.
    pub(super) fn up_to(self, longest: u64) -> Self {
        Self { longest, ..self }
    }

    /// Reads the bytes that come next.
    ///
    /// # Errors
    /// Too many elements in one message, one that is too long, or bytes that are no message.
    pub(super) fn read(&mut self, mut bytes: &[u8]) -> Result<(), Fault> {
        while let Some((&byte, rest)) = bytes.split_first() {
            self.state = if let State::Skip(left) = self.state {
                let now = (bytes.len() as u64).min(left);
                bytes = &bytes[now as usize..];
                self.at += now;
                if left == now { self.next_field()? } else { State::Skip(left - now) }
            } else {
                bytes = rest;
                self.read_byte(byte)?
            };
        }
        Ok(())
    }

    /// The state after a byte.
    fn read_byte(&mut self, byte: u8) -> Result<State, Fault> {
        if let State::Prefix(mut prefix, come) = self.state {
            prefix[come] = byte;
            let is_whole = come + 1 == PREFIX_BYTES;
            return if is_whole { self.begin(prefix) } else { Ok(State::Prefix(prefix, come + 1)) };
        }

        self.at += 1;
        match self.state {
            State::Key(mut key) => match key.push(byte)? {
                Some(key) => self.field(key),
                None => Ok(State::Key(key)),
            },
            State::Value(mut value) => match value.push(byte)? {
                Some(_) => self.next_field(),
                None => Ok(State::Value(value)),
            },
            State::Length(field, mut length) => match length.push(byte)? {
                Some(length) => self.enter(field, length),
                None => Ok(State::Length(field, length)),
            },
            State::Packed(left) => {
                if byte < 0x80 {
                    self.element()?;
                }
                if left == 1 { self.next_field() } else { Ok(State::Packed(left - 1)) }
            }
            State::Prefix(..) | State::Skip(_) => Ok(self.state),
        }
    }

    /// A message begins.
    fn begin(&mut self, [compressed, length @ ..]: [u8; PREFIX_BYTES]) -> Result<State, Fault> {
        let length = u64::from(u32::from_be_bytes(length));
        if length > self.longest {
            return Err(Fault::TooLong);
        }
        (self.at, self.count) = (0, 0);
        self.open.clear();
        self.open.push((self.root, length));

        // The framework refuses compressed messages.
        if compressed != 0 && length > 0 { Ok(State::Skip(length)) } else { self.next_field() }
    }

    /// Closes the messages that end here; what follows is a field, or another message of the call.
    fn next_field(&mut self) -> Result<State, Fault> {
        while let Some((_, end)) = self.open.last() {
            if self.at > *end {
                return Err(Fault::Malformed);
            }
            if self.at < *end {
                return Ok(State::Key(Varint::default()));
            }
            self.open.pop();
        }
        Ok(State::Prefix([0; PREFIX_BYTES], 0))
    }

    /// The number of a field and its kind on the wire.
    fn field(&mut self, key: u64) -> Result<State, Fault> {
        let unknown = Field { shape: Shape::Other, repeats: false };
        let message = self.open.last().map_or(self.root, |(message, _)| *message);
        let field = CONTRACT.messages[message].get(&(key >> 3)).copied().unwrap_or(unknown);
        match (key & 7, field) {
            (2, field) => Ok(State::Length(field, Varint::default())),
            (_, Field { shape: Shape::Message(_), .. }) => Err(Fault::Malformed),
            (0, field) => {
                if field.repeats {
                    self.element()?;
                }
                Ok(State::Value(Varint::default()))
            }
            (1, _) => Ok(State::Skip(8)),
            (5, _) => Ok(State::Skip(4)),
            // Groups, which this syntax does not have.
            _ => Err(Fault::Malformed),
        }
    }

    /// A field of so many bytes.
    fn enter(&mut self, field: Field, length: u64) -> Result<State, Fault> {
        let end = self.at.checked_add(length).ok_or(Fault::Malformed)?;
        if self.open.last().is_some_and(|(_, outer)| end > *outer) {
            return Err(Fault::Malformed);
        }

        match field.shape {
            Shape::Whole if length > 0 => return Ok(State::Packed(length)),
            Shape::Message(_) | Shape::Other if field.repeats => self.element()?,
            _ => {}
        }
        if let Shape::Message(message) = field.shape {
            if self.open.len() == MAX_DEPTH {
                return Err(Fault::Malformed);
            }
            self.open.push((message, end));
            return self.next_field();
        }
        if length > 0 { Ok(State::Skip(length)) } else { self.next_field() }
    }

    fn element(&mut self) -> Result<(), Fault> {
        self.count += 1;
        if self.count > self.allowed { Err(Fault::TooMany) } else { Ok(()) }
    }
}

#[cfg(test)]
mod tests {
    use nappe_proto::v1;
    use prost::Message;

    use super::*;

    const UPDATE: &str = "/nappe.v1.SimulationService/UpdateParameters";
    const WATCH: &str = "/nappe.v1.SimulationService/WatchFrames";

    fn framed(message: &impl Message) -> Vec<u8> {
        let body = message.encode_to_vec();
        [&[0][..], &(body.len() as u32).to_be_bytes(), &body].concat()
    }

    /// Reads bytes in pieces of each length, which must not matter.
    fn read(path: &str, allowed: u64, bytes: &[u8]) -> Result<(), Fault> {
        let of = |length| {
            let mut counter = ElementCounter::of(path, allowed).expect("a method");
            bytes.chunks(length).try_for_each(|piece| counter.read(piece))
        };
        let whole = of(bytes.len());
        for length in [1, 2, 3, 7] {
            assert_eq!(of(length), whole, "pieces of {length} bytes");
        }
        whole
    }

    fn update(pins: usize) -> v1::UpdateParametersRequest {
        let vector = v1::Vector3 { x: 1.0, y: -2.0, z: 300.0 };
        let pin = v1::PinUpdate { particle: 300_000, target: Some(vector), duration_seconds: 0.5 };
        v1::UpdateParametersRequest {
            session_id: "a-session".into(),
            at_step: u64::MAX,
            gravity: Some(vector),
            springs: vec![v1::SpringUpdate { body: "flag".into(), ..v1::SpringUpdate::default() }],
            pins: vec![pin; pins],
            ..v1::UpdateParametersRequest::default()
        }
    }

    #[test]
    fn elements_are_counted_in_each_message_of_a_call() {
        assert_eq!(read(UPDATE, 100, &framed(&update(99))), Ok(()));
        assert_eq!(read(UPDATE, 100, &framed(&update(100))), Err(Fault::TooMany));
        let twice = [framed(&update(60)), framed(&update(60))].concat();
        assert_eq!(read(UPDATE, 100, &twice), Ok(()));
        assert_eq!(read(UPDATE, 0, &framed(&v1::UpdateParametersRequest::default())), Ok(()));
        assert!(ElementCounter::of("/grpc.health.v1.Health/Check", 1).is_none());
    }

    #[test]
    fn empty_elements_and_numbers_that_stand_together_count() {
        let many = v1::WatchFramesRequest { fields: vec![1; 101], ..v1::WatchFramesRequest::default() };
        assert_eq!(read(WATCH, 101, &framed(&many)), Ok(()));
        assert_eq!(read(WATCH, 100, &framed(&many)), Err(Fault::TooMany));

        // Field 6, a message, of no bytes.
        let body = [0x32, 0].repeat(101);
        let message = [&[0][..], &(body.len() as u32).to_be_bytes(), &body].concat();
        assert_eq!(read(UPDATE, 101, &message), Ok(()));
        assert_eq!(read(UPDATE, 100, &message), Err(Fault::TooMany));
    }

    #[test]
    fn a_message_that_announces_too_much_is_refused_before_it_comes() {
        let read = |longest: u64| {
            let counter = ElementCounter::of(UPDATE, 0).expect("a method");
            counter.up_to(longest).read(&[0, 0, 0, 4, 1])
        };
        assert_eq!((read(1025), read(1024)), (Ok(()), Err(Fault::TooLong)));
    }

    #[test]
    fn what_the_decoder_would_refuse_is_refused_and_unknown_fields_are_not() {
        let message = |body: &[u8]| [&[0][..], &(body.len() as u32).to_be_bytes(), body].concat();
        // A field 50 that this version does not know, of each kind.
        for body in
            [&[0x90, 3, 1][..], &[0x91, 3, 0, 0, 0, 0, 0, 0, 0, 0], &[0x92, 3, 1, 7], &[0x95, 3, 0, 0, 0, 0]]
        {
            assert_eq!(read(UPDATE, 0, &message(body)), Ok(()), "{body:?}");
        }
        // A group, a number where a message belongs, a length beyond the message, a number without end.
        for body in [&[0x93, 3][..], &[0x30, 1], &[0x32, 9, 0], &[0xFF; 11]] {
            assert_eq!(read(UPDATE, 9, &message(body)), Err(Fault::Malformed), "{body:?}");
        }
    }
}
