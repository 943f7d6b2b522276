//! Which values a variable permits.

use crate::table::Row;
use crate::value::{Kind, Scalar};

impl<M> Row<M> {
    /// Whether a value may be set: finite, within the limits, one of the enumeration's values.
    #[inline]
    #[must_use]
    pub fn permits(&self, value: Scalar<'_>) -> bool {
        let (min, max) = self.limits();
        let within = |value: f64| value >= min && value <= max;
        match value {
            Scalar::Real(value) => within(value),
            Scalar::Integer(value) => match self.items {
                Some(enumeration) => enumeration.items.iter().any(|item| item.value == value),
                None => within(f64::from(value)),
            },
            Scalar::Boolean(_) | Scalar::String(_) => true,
        }
    }

    /// Smallest and largest permitted number: every finite one where nothing is declared.
    #[inline]
    #[must_use]
    pub fn limits(&self) -> (f64, f64) {
        (self.min.unwrap_or(f64::MIN), self.max.unwrap_or(f64::MAX))
    }

    /// The permitted values, for messages.
    #[must_use]
    pub fn range(&self) -> String {
        if let Some(enumeration) = self.items {
            let items = enumeration.items.iter().map(|item| format!("{} ({})", item.value, item.name));
            return items.collect::<Vec<_>>().join(", ");
        }
        let unit = if self.unit.is_empty() { String::new() } else { format!(" {}", self.unit) };
        match (self.min, self.max) {
            (Some(min), Some(max)) => format!("[{min}, {max}]{unit}"),
            (Some(min), None) => format!("[{min}, inf){unit}"),
            (None, Some(max)) => format!("(-inf, {max}]{unit}"),
            (None, None) if self.kind == Kind::Integer => "of its type".to_owned(),
            (None, None) => format!("(-inf, inf){unit}"),
        }
    }
}
