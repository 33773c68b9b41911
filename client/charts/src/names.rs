//! Names of methods as a reader writes them, from those that tables of the gallery have.

use nappe_study::{Method, Variant};

/// The name that a reader writes for a method of cloth or a variant of snow with this name; of others, that name itself.
pub(crate) fn reader(name: &str) -> String {
    let cloth = Method::all().into_iter().find(|method| method.name() == name).map(Method::reader_name);
    let snow = || Variant::all().into_iter().find(|variant| variant.name() == name).map(Variant::reader_name);
    cloth.or_else(snow).unwrap_or_else(|| name.to_owned())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_of_tables_are_read() {
        assert_eq!(reader("implicit_midpoint_newton"), "implicit midpoint, Newton");
        assert_eq!(reader("pic_flip_cubic"), "PIC/FLIP, cubic kernel");
        assert_eq!(reader("something else"), "something else");
    }
}
