//! What crosses the interface: the four value types of FMI 2.0, and the Rust types that fit them.

/// One value on its way in or out.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Scalar<'a> {
    /// fmi2Real.
    Real(f64),
    /// fmi2Integer; enumerations travel as integers too.
    Integer(i32),
    /// fmi2Boolean.
    Boolean(bool),
    /// fmi2String.
    String(&'a str),
}

impl Scalar<'_> {
    /// The number of a Real; rows of another type are never asked for it.
    #[doc(hidden)]
    #[inline]
    #[must_use]
    pub fn real(self) -> f64 {
        match self {
            Scalar::Real(value) => value,
            _ => 0.0,
        }
    }
}

/// Which of the four types a variable has.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// fmi2Real.
    Real,
    /// fmi2Integer.
    Integer,
    /// fmi2Boolean.
    Boolean,
    /// fmi2String.
    String,
}

impl Kind {
    /// Its name in the XML.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Kind::Real => "Real",
            Kind::Integer => "Integer",
            Kind::Boolean => "Boolean",
            Kind::String => "String",
        }
    }
}

/// A Rust type that a row of the table can bind to.
pub trait Value {
    /// The FMI type it travels as.
    const KIND: Kind;
    /// The value as it leaves.
    fn to_scalar(&self) -> Scalar<'_>;
    /// Takes over an incoming value; false if this type cannot hold it.
    fn assign(&mut self, value: Scalar<'_>) -> bool;
}

/// A value that a computed row (`{ get ..., set ... }`) hands over.
pub trait FromScalar: Sized {
    /// The value, or None if this type cannot hold it.
    fn from_scalar(value: Scalar<'_>) -> Option<Self>;
}

impl<T: Value + Default> FromScalar for T {
    fn from_scalar(value: Scalar<'_>) -> Option<Self> {
        let mut converted = T::default();
        converted.assign(value).then_some(converted)
    }
}

impl Value for f64 {
    const KIND: Kind = Kind::Real;

    #[inline]
    fn to_scalar(&self) -> Scalar<'_> {
        Scalar::Real(*self)
    }

    #[inline]
    fn assign(&mut self, value: Scalar<'_>) -> bool {
        let Scalar::Real(value) = value else { return false };
        *self = value;
        true
    }
}

impl Value for bool {
    const KIND: Kind = Kind::Boolean;

    fn to_scalar(&self) -> Scalar<'_> {
        Scalar::Boolean(*self)
    }

    fn assign(&mut self, value: Scalar<'_>) -> bool {
        let Scalar::Boolean(value) = value else { return false };
        *self = value;
        true
    }
}

impl Value for String {
    const KIND: Kind = Kind::String;

    fn to_scalar(&self) -> Scalar<'_> {
        Scalar::String(self)
    }

    fn assign(&mut self, value: Scalar<'_>) -> bool {
        let Scalar::String(value) = value else { return false };
        value.clone_into(self);
        true
    }
}

impl From<f64> for Scalar<'_> {
    fn from(value: f64) -> Self {
        Scalar::Real(value)
    }
}

impl From<bool> for Scalar<'_> {
    fn from(value: bool) -> Self {
        Scalar::Boolean(value)
    }
}

/// Integers of every width travel as fmi2Integer, which has 32 bits and a sign.
macro_rules! integers {
    ($($integer:ty),*) => {$(
        impl From<$integer> for Scalar<'_> {
            fn from(value: $integer) -> Self {
                // A larger value cannot have come in through the interface; the nearest one says "too many".
                Scalar::Integer(i32::try_from(value).unwrap_or(i32::MAX))
            }
        }

        impl Value for $integer {
            const KIND: Kind = Kind::Integer;

            fn to_scalar(&self) -> Scalar<'_> {
                Scalar::from(*self)
            }

            fn assign(&mut self, value: Scalar<'_>) -> bool {
                let Scalar::Integer(value) = value else { return false };
                <$integer>::try_from(value).map(|value| *self = value).is_ok()
            }
        }
    )*};
}

integers!(i32, u32, u64, usize);

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn negative_integers_do_not_fit_unsigned_fields() {
        let mut seed = 7_u64;
        assert!(!seed.assign(Scalar::Integer(-1)));
        assert_eq!(seed, 7);
        assert!(seed.assign(Scalar::Integer(3)));
        assert_eq!(seed.to_scalar(), Scalar::Integer(3));
    }

    #[test]
    fn values_of_another_type_are_refused() {
        assert!(!1.0_f64.assign(Scalar::Integer(1)));
        assert!(!String::new().assign(Scalar::Boolean(true)));
        assert!(!true.assign(Scalar::String("true")));
    }
}
