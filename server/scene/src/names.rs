//! Names and numbers in scene files for the simulation's closed sets: serde by name, without serde in `sim`.

/// A serde module for a closed set with `ALL` and `name()`.
macro_rules! by_name {
    ($(#[$doc:meta])* $module:ident, $set:ty) => {
        $(#[$doc])*
        pub(crate) mod $module {
            use serde::{Deserialize, Deserializer, Serializer, de::Error};

            type Set = $set;

            #[allow(clippy::trivially_copy_pass_by_ref, reason = "the signature that serde asks for")]
            pub(crate) fn serialize<S: Serializer>(value: &Set, serializer: S) -> Result<S::Ok, S::Error> {
                serializer.serialize_str(value.name())
            }

            pub(crate) fn deserialize<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Set, D::Error> {
                let name = String::deserialize(deserializer)?;
                Set::ALL
                    .into_iter()
                    .find(|value| value.name() == name)
                    .ok_or_else(|| D::Error::custom(format!("'{name}' is not a name of this set")))
            }
        }
    };
}

by_name!(
    /// Precisions of the state.
    precision, nappe_sim::math::Precision);
by_name!(
    /// Integrators of cloth.
    integrator, nappe_sim::cloth::Integrator);
by_name!(
    /// Ways of solving an implicit step.
    minimizer, nappe_sim::cloth::MinimizerKind);
by_name!(
    /// Treatments of compressed springs.
    hessian, nappe_sim::cloth::Hessian);
by_name!(
    /// What becomes of steps in which particles go through colliders.
    on_pass, nappe_sim::cloth::OnPass);
by_name!(
    /// Whether crossings of surfaces are counted.
    surface_check, nappe_sim::cloth::SurfaceCheck);
by_name!(
    /// What follows the last frame of a figure.
    repeat, nappe_sim::cloth::Repeat);
by_name!(
    /// Laws of elements of cloth.
    element_law, nappe_sim::cloth::ElementKind);
by_name!(
    /// Preconditioners of the linear solver of cloth.
    preconditioner, nappe_sim::linalg::PreconditionerKind);
by_name!(
    /// Ways of applying the matrix.
    operator, nappe_sim::linalg::OperatorKind);

by_name!(
    /// Kernels of snow.
    kernel, nappe_sim::snow::Kernel);
by_name!(
    /// Elastic laws of snow.
    law, nappe_sim::snow::Law);
by_name!(
    /// How snow meets a collider.
    contact, nappe_sim::collide::Contact);
by_name!(
    /// What becomes of what begins inside a collider.
    start_inside, nappe_sim::collide::StartInside);

/// A law, or none.
pub(crate) mod maybe_law {
    use nappe_sim::snow::Law;
    use serde::{Deserializer, Serializer};

    #[allow(
        clippy::ref_option,
        clippy::trivially_copy_pass_by_ref,
        reason = "the signature that serde asks for"
    )]
    pub(crate) fn serialize<S: Serializer>(value: &Option<Law>, serializer: S) -> Result<S::Ok, S::Error> {
        match value {
            Some(law) => super::law::serialize(law, serializer),
            None => serializer.serialize_none(),
        }
    }

    pub(crate) fn deserialize<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Option<Law>, D::Error> {
        super::law::deserialize(deserializer).map(Some)
    }
}

/// Whether a text need not say a value.
pub(crate) fn is_default<T: Default + PartialEq>(value: &T) -> bool {
    *value == T::default()
}

/// TOML's integers have 63 bits and a sign: a number beyond them is written as their largest, which
/// the schema refuses with the field's range.
#[allow(clippy::trivially_copy_pass_by_ref, reason = "the signature that serde asks for")]
pub(crate) fn whole<T, S>(value: &T, serializer: S) -> Result<S::Ok, S::Error>
where
    T: Copy + TryInto<i64>,
    S: serde::Serializer,
{
    serializer.serialize_i64((*value).try_into().unwrap_or(i64::MAX))
}
