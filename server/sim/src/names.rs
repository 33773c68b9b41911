//! Enums whose values have names: the list of them, and the name of each.

/// Gives an enum a list of its values, in the order written here, and their names.
macro_rules! names {
    ($kind:ident { $($value:ident: $name:literal),+ $(,)? }) => {
        impl $kind {
            /// Every one, in the order of tables.
            pub const ALL: [Self; [$($name),+].len()] = [$(Self::$value),+];

            /// Its name in scene files, in messages and on the wire.
            pub const fn name(self) -> &'static str {
                match self {
                    $(Self::$value => $name,)+
                }
            }
        }
    };
}
pub(crate) use names;
