//! The `variables!` macro: the table as one reads it.

/// Declares the variables of a model and evaluates to its `&'static Table`.
///
/// ```text
/// variables! { MODEL;
///     ROLE name ["unit"] "Description", attribute value, ... => path.to.field;              scalar
///     ROLE name [LEN] ["unit"] "Description" => path.to.indexable;                          name[1] .. name[LEN]
///     ROLE name [LEN] ["unit"] "Description" => |m, k| m.plan[k].e_y;                       any place of the model
///     ROLE name "Description", items &MODE => { get |m| m.mode as i32, set |m, v: i32| m.mode = Mode::from(v) };
/// }
/// ```
///
/// - ROLE is `Input`, `Output`, `Parameter` (fixed), `Tunable` or `Local`.
/// - The type follows from the field: `f64` is Real, `i32`, `u32`, `u64` and `usize` are Integer, `bool` is Boolean, `String` is
///   String. An Integer with `items &ENUMERATION` is an enumeration.
/// - The unit may be left out of scalars; arrays without a unit write `[""]`.
/// - Start values of inputs and parameters are those of the model's `Default`; they are not typed again.
/// - Attributes: `min 0.0`, `max 1.0` (enforced when set), `nominal 1e4`, `items &ENUMERATION`, `display false` (no display unit),
///   `discrete true` (a Real output that is held between samples), `depends &["v_x"]` (the inputs that an output depends on
///   directly, by name without index; `&[]`: none; left out: all), `depends_initially &["mu"]` (before the first step these too),
///   `lazy false` (a calculated row that `step` itself keeps up to
///   date, so that reading it need not call `Model::refresh`), `terminal "preview"` (drawn and connected with its like as one).
/// - `{ get ..., set ... }` converts; `set` is left out of outputs, and both take an index after `m` in arrays.
#[macro_export]
macro_rules! variables {
    ($model:ty; $(
        $role:ident $name:ident $([$($bracket:tt)*])* $description:literal $(, $attribute:ident $setting:expr)*
        => $($first:ident $(. $rest:ident)*)? $({$($accessors:tt)*})? $(|$m:ident $(, $k:ident)?| $place:expr)?;
    )*) => {{
        const ROWS: &[$crate::Row<$model>] = &[$(
            $crate::variables!(@row $model;
                ($role $name $([$($bracket)*])* $description)
                $($first $(. $rest)*)? $({$($accessors)*})? $(|$m $(, $k)?| $place)?
            )$(.$attribute($setting))*
        ),*];
        const LEN: usize = $crate::table::count(ROWS);
        static PLACES: [$crate::Place; LEN] = $crate::table::flatten(ROWS);
        static TABLE: $crate::Table<$model> = $crate::Table::new(ROWS, &PLACES);
        &TABLE
    }};

    // Scalars may leave out the unit; it is added here, so that the rules below see one form.
    (@row $model:ty; ($role:ident $name:ident $description:literal) $($binding:tt)*) => {
        $crate::variables!(@row $model; ($role $name [""] $description) $($binding)*)
    };

    (@row $model:ty; ($role:ident $name:ident [$unit:literal] $description:literal) $($path:ident).+) => {
        $crate::variables!(@place $model; ($role, $name, None, $unit, $description) m _k m.$($path).+)
    };
    (@row $model:ty; ($role:ident $name:ident [$len:expr] [$unit:literal] $description:literal) $($path:ident).+) => {
        $crate::variables!(@place $model; ($role, $name, Some($len), $unit, $description) m k m.$($path).+[k])
    };

    (@row $model:ty; ($role:ident $name:ident [$unit:literal] $description:literal) |$m:ident| $place:expr) => {
        $crate::variables!(@place $model; ($role, $name, None, $unit, $description) $m _k $place)
    };
    (@row $model:ty; ($role:ident $name:ident [$len:expr] [$unit:literal] $description:literal) |$m:ident, $k:ident| $place:expr) => {
        $crate::variables!(@place $model; ($role, $name, Some($len), $unit, $description) $m $k $place)
    };

    (@row $model:ty; ($role:ident $name:ident [$unit:literal] $description:literal)
        {get |$m:ident| $get:expr $(, set |$n:ident, $v:ident : $t:ty| $set:expr)?}) => {
        $crate::variables!(@computed $model; ($role, $name, None, $unit, $description) |$m, _k| $get $(, |$n, _l, $v: $t| $set)?)
    };
    (@row $model:ty; ($role:ident $name:ident [$len:expr] [$unit:literal] $description:literal)
        {get |$m:ident, $k:ident| $get:expr $(, set |$n:ident, $l:ident, $v:ident : $t:ty| $set:expr)?}) => {
        $crate::variables!(@computed $model; ($role, $name, Some($len), $unit, $description) |$m, $k| $get $(, |$n, $l, $v: $t| $set)?)
    };

    (@place $model:ty; ($role:ident, $name:ident, $len:expr, $unit:literal, $description:literal) $m:ident $k:ident $place:expr) => {
        $crate::Row::field(
            ($crate::Role::$role, stringify!($name), $len, $unit, $description),
            |$m: &$model, $k: usize| &$place,
            (
                |$m: &$model, $k: usize| $crate::Value::to_scalar(&$place),
                |$m: &$model, first: usize, values: &mut [f64]| {
                    for ($k, value) in (first..).zip(values) {
                        *value = $crate::Value::to_scalar(&$place).real();
                    }
                },
            ),
            (
                |$m: &mut $model, $k: usize, value: $crate::Scalar<'_>| $crate::Value::assign(&mut $place, value),
                |$m: &mut $model, first: usize, values: &[f64]| {
                    for ($k, &value) in (first..).zip(values) {
                        $crate::Value::assign(&mut $place, $crate::Scalar::Real(value));
                    }
                },
            ),
        )
    };

    (@computed $model:ty; ($role:ident, $name:ident, $len:expr, $unit:literal, $description:literal)
        |$m:ident, $k:ident| $get:expr) => {
        $crate::Row::computed(
            ($crate::Role::$role, stringify!($name), $len, $unit, $description),
            |$m: &$model, $k: usize| $get,
            (
                |$m: &$model, $k: usize| $crate::Scalar::from($get),
                |$m: &$model, first: usize, values: &mut [f64]| {
                    for ($k, value) in (first..).zip(values) {
                        *value = $crate::Scalar::from($get).real();
                    }
                },
            ),
            None,
        )
    };
    (@computed $model:ty; ($role:ident, $name:ident, $len:expr, $unit:literal, $description:literal)
        |$m:ident, $k:ident| $get:expr, |$n:ident, $l:ident, $v:ident : $t:ty| $set:expr) => {
        $crate::Row::computed(
            ($crate::Role::$role, stringify!($name), $len, $unit, $description),
            |$m: &$model, $k: usize| $get,
            (
                |$m: &$model, $k: usize| $crate::Scalar::from($get),
                |$m: &$model, first: usize, values: &mut [f64]| {
                    for ($k, value) in (first..).zip(values) {
                        *value = $crate::Scalar::from($get).real();
                    }
                },
            ),
            Some((
                |$n: &mut $model, $l: usize, value: $crate::Scalar<'_>| {
                    let Some($v) = <$t as $crate::FromScalar>::from_scalar(value) else { return false };
                    $set;
                    true
                },
                |$n: &mut $model, first: usize, values: &[f64]| {
                    for ($l, &value) in (first..).zip(values) {
                        if let Some($v) = <$t as $crate::FromScalar>::from_scalar($crate::Scalar::Real(value)) {
                            $set;
                        }
                    }
                },
            )),
        )
    };
}
