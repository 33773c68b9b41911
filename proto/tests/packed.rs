//! Packed arrays: the golden vectors of every language, the bound on random arrays, and bytes that hold no array.
//!
//! `NAPPE_BLESS=1` writes `packed/*.json` anew; decoders in other languages read the same files.

use std::{env, fs, path::PathBuf};

use nappe_proto::packed::{Effort, Step, UnpackError, pack, unpack};
use proptest::prelude::*;
use serde_json::{Value, json};

/// A golden vector, before it is packed.
struct Case {
    name: &'static str,
    exponent: i32,
    components: usize,
    values: Vec<f32>,
    /// Whole numbers of the frame before.
    base: Option<Vec<i32>>,
}

/// A sheet of 9 x 7 particles, 25 mm apart, that sags and turns with time.
fn sheet(time: f32) -> Vec<f32> {
    let particle = |at: u8| {
        let (x, z) = (f32::from(at % 9) * 0.025, f32::from(at / 9) * 0.025);
        [x - time * z, 1.0 - time * x * x - 0.5 * time * z, z + time * x * 0.25]
    };
    (0..63).flat_map(particle).collect()
}

fn quantized(exponent: i32, values: &[f32]) -> Vec<i32> {
    Step::new(exponent).expect("a step").quantize(values).expect("within reach")
}

fn cases() -> Vec<Case> {
    let farthest = (f32::from(i16::MAX) * 256.0 + 255.0) * 0.25;
    let case = |name, exponent, components, values: &[f32]| Case {
        name,
        exponent,
        components,
        values: values.to_vec(),
        base: None,
    };
    vec![
        case("key", -13, 3, &sheet(0.0)),
        Case { base: Some(quantized(-13, &sheet(0.0))), ..case("delta", -13, 3, &sheet(0.125)) },
        case("no_particle", -13, 3, &[]),
        case("one_particle", -10, 3, &[1.5, -2.25, 0.1]),
        case("one_component", -7, 1, &[0.75, 1.0, 1.0, 0.996, 1.25, 0.0]),
        case("one_plane", -13, 3, &[0.0; 12]),
        case("ties", 0, 1, &[0.5, 1.5, 2.5, -0.5, -1.5, -2.5]),
        case("farthest", -2, 1, &[farthest, -farthest, farthest, 0.0]),
        Case {
            base: Some(vec![8_388_607, -8_388_607]),
            ..case("farthest_delta", -2, 1, &[-farthest, farthest])
        },
    ]
}

fn folder() -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("tests/packed")
}

fn hex(bytes: &[u8]) -> String {
    bytes.iter().fold(String::new(), |digits, byte| digits + &format!("{byte:02x}"))
}

/// The golden vector as its file holds it.
fn written(case: &Case) -> Value {
    let step = Step::new(case.exponent).expect("a step");
    let numbers = step.quantize(&case.values).expect("within reach");
    let bytes = pack(&numbers, case.components, case.base.as_deref(), Effort::Fast);
    json!({
        "step": step.size(),
        "bound": step.bound(),
        "components": case.components,
        "particles": case.values.len() / case.components,
        "values": case.values,
        "base": case.base,
        "bytes": hex(&bytes),
        "numbers": numbers,
        "restored": step.restore(&numbers),
    })
}

/// JSON with a line per member, however long its list is.
fn lines(value: &Value) -> String {
    let members = value.as_object().expect("an object").iter();
    let lines: Vec<String> = members.map(|(name, value)| format!("  \"{name}\": {value}")).collect();
    format!("{{\n{}\n}}\n", lines.join(",\n"))
}

#[test]
fn the_golden_vectors_are_what_is_packed() {
    let mut known = Vec::new();
    for case in cases() {
        let path = folder().join(format!("{}.json", case.name));
        let made = lines(&written(&case));
        if env::var_os("NAPPE_BLESS").is_some_and(|value| value == "1") {
            fs::write(&path, &made).expect("it is written");
        }
        let golden = fs::read_to_string(&path).expect("a golden vector");
        assert_eq!(golden, made, "{}", path.display());
        known.push(path);
    }
    let files = fs::read_dir(folder()).expect("the folder").map(|entry| entry.expect("an entry").path());
    assert!(files.into_iter().all(|path| known.contains(&path)), "a file without a case");
}

#[test]
fn golden_vectors_give_their_numbers_again_within_the_bound() {
    for case in cases() {
        let text = fs::read_to_string(folder().join(format!("{}.json", case.name))).expect("a golden vector");
        let golden: Value = serde_json::from_str(&text).expect("JSON");
        let list = |name: &str| golden[name].as_array().expect("a list").clone();
        let digits = golden["bytes"].as_str().expect("a text").as_bytes();
        let byte = |pair: &[u8]| {
            u8::from_str_radix(std::str::from_utf8(pair).expect("ASCII"), 16).expect("two digits")
        };
        let bytes: Vec<u8> = digits.chunks(2).map(byte).collect();
        let count = golden["particles"].as_u64().expect("a count") as usize;
        let numbers = unpack(&bytes, count, case.components, case.base.as_deref()).expect("packed");
        assert_eq!(json!(numbers), json!(list("numbers")), "{}", case.name);
        let restored = Step::new(case.exponent).expect("a step").restore(&numbers);
        assert_eq!(json!(restored), json!(list("restored")), "{}", case.name);
        let bound = golden["bound"].as_f64().expect("a number");
        for (value, again) in case.values.iter().zip(&restored) {
            assert!((f64::from(*value) - f64::from(*again)).abs() <= bound, "{}: {value} {again}", case.name);
        }
    }
}

#[test]
fn a_step_within_a_bound_is_the_largest_power_of_two() {
    for (bound, exponent) in [(0.5, 0), (0.499, -1), (1.0, 1), (6.2e-5, -13), (6.1e-5, -14), (3.0, 2)] {
        let step = Step::within(bound).expect("a step");
        assert_eq!(step.exponent(), exponent, "{bound}");
        assert!(step.bound() <= bound && bound < 2.0 * step.bound());
    }
    for wrong in [0.0, -1.0, f64::NAN, f64::INFINITY, 1e-300, 1e300] {
        assert_eq!(Step::within(wrong), None, "{wrong}");
    }
    assert!(Step::new(-127).is_none() && Step::new(105).is_none() && Step::new(104).is_some());
}

#[test]
fn numbers_out_of_reach_are_named() {
    let step = Step::new(0).expect("a step");
    for far in [8_388_607.5, -8_388_608.0, 1e30, f64::NAN, f64::INFINITY] {
        let refused = step.quantize(&[0.0, 1.0, far, far]).expect_err("out of reach");
        assert_eq!(refused.index, 2, "{far}");
    }
    assert_eq!(step.quantize(&[8_388_607.4_f64, -8_388_607.4]), Ok(vec![8_388_607, -8_388_607]));
    let largest = Step::new(104).expect("a step");
    assert!(largest.restore(&[8_388_607, -8_388_607]).iter().all(|number| number.is_finite()));
    let least = Step::new(-126).expect("a step");
    assert_eq!(least.quantize(&least.restore(&[1, 8_388_607])), Ok(vec![1, 8_388_607]));
}

#[test]
fn bytes_that_hold_no_array_are_refused() {
    let numbers: Vec<i32> = (0..300).map(|number| number * number % 991).collect();
    let bytes = pack(&numbers, 3, None, Effort::Small);
    assert_eq!(unpack(&bytes, 100, 3, None).as_deref(), Ok(&numbers[..]));
    let refused = |bytes: &[u8], count| unpack(bytes, count, 3, None).expect_err("no array of this shape");
    assert!(matches!(refused(&bytes[..bytes.len() - 1], 100), UnpackError::Deflate { .. }), "cut off");
    assert!(matches!(refused(&[&bytes[..], b"x"].concat(), 100), UnpackError::Deflate { .. }), "too long");
    assert!(matches!(refused(&bytes, 99), UnpackError::Planes { count: 297, .. }), "of another shape");
    assert!(matches!(refused(&[], 100), UnpackError::Deflate { .. }), "nothing");
    assert!(matches!(refused(&bytes, 0), UnpackError::Deflate { allowed: 0 }), "for no particle");
    let zeros = pack(&vec![0; 3_000_000], 3, None, Effort::Small);
    assert!(matches!(refused(&zeros, 100), UnpackError::Deflate { allowed: 1200 }), "a bomb");
    let last = pack(&[8_388_607; 3], 3, None, Effort::Fast);
    let beyond = unpack(&last, 1, 3, Some(&[0, 1, 0]));
    assert_eq!(beyond, Err(UnpackError::Range { index: 1 }));
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(10_000))]

    #[test]
    fn random_arrays_come_back_within_the_bound(
        exponent in -20_i32..4,
        components in 1_usize..4,
        whole in prop::collection::vec((any::<i32>(), any::<i32>(), 1_u32..32), 0..40),
        effort in prop_oneof![Just(Effort::Fast), Just(Effort::Small)],
    ) {
        let step = Step::new(exponent).expect("a step");
        let whole = &whole[..whole.len() / components * components];
        // Numbers of every size below the limit, between two points of the grid.
        let near = |raw: i32, bits: u32| f64::from(raw >> bits.max(9)) + f64::from(raw & 0xff) / 256.0;
        let values: Vec<f64> = whole
            .iter()
            .map(|&(raw, _, bits)| (near(raw, bits) * step.size()).clamp(-8_388_607.0 * step.size(), 8_388_607.0 * step.size()))
            .collect();
        let base: Vec<i32> = whole.iter().map(|&(_, raw, bits)| (raw >> bits.max(9)).max(-8_388_607)).collect();
        let numbers = step.quantize(&values).expect("within reach");
        let count = values.len() / components;
        for base in [None, Some(&base[..])] {
            let bytes = pack(&numbers, components, base, effort);
            let again = unpack(&bytes, count, components, base).expect("what was packed");
            prop_assert_eq!(&again, &numbers);
            for (value, restored) in values.iter().zip(step.restore(&again)) {
                prop_assert!((value - f64::from(restored)).abs() <= step.bound());
            }
        }
    }
}
