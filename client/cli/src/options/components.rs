//! Vectors and turns as the command line has them: finite numbers between commas.

use nappe_client::v1;

/// A vector: `0,-9.81,0`.
///
/// # Errors
/// What is not three finite numbers.
pub(crate) fn vector(text: &str) -> Result<v1::Vector3, String> {
    let numbers = numbers(text)?;
    match numbers[..] {
        [x, y, z] => Ok(v1::Vector3 { x, y, z }),
        _ => Err(format!("{} numbers; a vector has three: 0,-9.81,0", numbers.len())),
    }
}

/// A turn as a quaternion: `0,0.6,0,0.8`. Whether its length is 1 is the server's to check.
///
/// # Errors
/// What is not four finite numbers.
pub(crate) fn turn(text: &str) -> Result<v1::Quaternion, String> {
    let numbers = numbers(text)?;
    match numbers[..] {
        [x, y, z, w] => Ok(v1::Quaternion { x, y, z, w }),
        _ => Err(format!("{} numbers; a turn has four, x,y,z,w: 0,0,0,1 for none", numbers.len())),
    }
}

fn numbers(text: &str) -> Result<Vec<f64>, String> {
    text.split(',').map(number).collect()
}

/// A finite number.
///
/// # Errors
/// What is none.
pub(crate) fn number(text: &str) -> Result<f64, String> {
    match text.trim().parse::<f64>() {
        Ok(value) if value.is_finite() => Ok(value),
        _ => Err(format!("'{text}' is not a finite number")),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn vectors_have_three_numbers_and_turns_have_four() {
        assert_eq!(vector("0, -9.81,1e1"), Ok(v1::Vector3 { x: 0.0, y: -9.81, z: 10.0 }));
        assert_eq!(turn("0,0.6,0,-0.8"), Ok(v1::Quaternion { x: 0.0, y: 0.6, z: 0.0, w: -0.8 }));
        for wrong in ["", "1,2", "1,2,3,4", "1,2,inf", "1;2;3"] {
            assert!(vector(wrong).is_err(), "{wrong}");
        }
        for wrong in ["", "1,2,3", "1,2,3,4,5", "0,0,0,nan", "0 0 0 1"] {
            assert!(turn(wrong).is_err(), "{wrong}");
        }
    }
}
