//! The table of variables: one row declares name, type, unit, limits, documentation and the field of the model. Value
//! references, XML, getters, setters and start values follow from it. Everything in it is constant, so that unloading
//! the library leaves nothing behind.

use std::sync::OnceLock;

use crate::guid;
pub use crate::place::{Place, count, flatten};
use crate::value::{Kind, Scalar, Value};

/// Causality and variability of a row.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Role {
    /// Set by the importer at any time.
    Input,
    /// Computed by the model.
    Output,
    /// Set before or in initialisation mode, frozen afterwards.
    Parameter,
    /// A parameter that may also change between steps.
    Tunable,
    /// Computed by the model, for diagnosis.
    Local,
}

impl Role {
    /// Whether the model computes the variable.
    #[must_use]
    pub const fn is_calculated(self) -> bool {
        matches!(self, Role::Output | Role::Local)
    }
}

/// An enumeration type: its values travel as integers.
#[derive(Debug)]
pub struct Enumeration {
    /// Name of the type in the XML.
    pub name: &'static str,
    /// What the values distinguish.
    pub description: &'static str,
    /// The permitted values.
    pub items: &'static [Item],
}

/// One value of an enumeration type.
#[derive(Debug)]
pub struct Item {
    /// The integer that travels.
    pub value: i32,
    /// Name in the XML.
    pub name: &'static str,
    /// What it means.
    pub description: &'static str,
}

/// How the interface reads an element of a variable.
pub type Get<M> = fn(&M, usize) -> Scalar<'_>;
/// How the interface writes an element of a variable; false if the value does not fit.
pub type Set<M> = fn(&mut M, usize, Scalar<'_>) -> bool;

/// How the interface reads consecutive elements of a Real variable.
pub type GetReals<M> = fn(&M, usize, &mut [f64]);
/// How the interface writes consecutive elements of a Real variable.
pub type SetReals<M> = fn(&mut M, usize, &[f64]);

/// One declaration: a scalar variable, or an array whose elements become variables.
pub struct Row<M> {
    /// Name without the index.
    pub name: &'static str,
    /// Causality and variability.
    pub role: Role,
    /// Type.
    pub kind: Kind,
    /// Number of elements of an array.
    pub len: Option<usize>,
    /// Unit such as "m/s2", or "" for none.
    pub unit: &'static str,
    /// Documentation.
    pub description: &'static str,
    /// Smallest permitted value.
    pub min: Option<f64>,
    /// Largest permitted value.
    pub max: Option<f64>,
    /// Typical magnitude.
    pub nominal: Option<f64>,
    /// The permitted values of an enumeration.
    pub items: Option<&'static Enumeration>,
    /// Names of the inputs that the value depends on directly; None: all of them.
    pub depends: Option<&'static [&'static str]>,
    /// Names of the inputs that the value depends on before the first step, beside those.
    pub depends_initially: &'static [&'static str],
    /// Whether people may want to see the unit's usual display unit.
    pub display: bool,
    /// Whether a Real changes only at certain instants.
    pub discrete: bool,
    /// Whether reading must call `Model::refresh` first when something changed.
    pub lazy: bool,
    /// The terminal that the variable belongs to: what is drawn and connected as one.
    pub terminal: Option<&'static str>,
    pub(crate) get: Get<M>,
    pub(crate) set: Option<Set<M>>,
    pub(crate) get_reals: GetReals<M>,
    pub(crate) set_reals: Option<SetReals<M>>,
}

impl<M> Row<M> {
    #[doc(hidden)]
    pub const fn field<T: Value>(
        declared: (Role, &'static str, Option<usize>, &'static str, &'static str),
        _witness: fn(&M, usize) -> &T,
        (get, get_reals): (Get<M>, GetReals<M>),
        (set, set_reals): (Set<M>, SetReals<M>),
    ) -> Self {
        Self::new(declared, T::KIND, (get, get_reals), Some((set, set_reals)))
    }

    #[doc(hidden)]
    pub const fn computed<T: Value>(
        declared: (Role, &'static str, Option<usize>, &'static str, &'static str),
        _witness: fn(&M, usize) -> T,
        get: (Get<M>, GetReals<M>),
        set: Option<(Set<M>, SetReals<M>)>,
    ) -> Self {
        Self::new(declared, T::KIND, get, set)
    }

    const fn new(
        (role, name, len, unit, description): (Role, &'static str, Option<usize>, &'static str, &'static str),
        kind: Kind,
        (get, get_reals): (Get<M>, GetReals<M>),
        set: Option<(Set<M>, SetReals<M>)>,
    ) -> Self {
        // `Option::unzip` is not a constant function.
        let (set, set_reals) = match set {
            Some((set, set_reals)) => (Some(set), Some(set_reals)),
            None => (None, None),
        };
        Self {
            name,
            role,
            kind,
            len,
            unit,
            description,
            min: None,
            max: None,
            nominal: None,
            items: None,
            depends: None,
            depends_initially: &[],
            display: true,
            discrete: false,
            lazy: role.is_calculated(),
            terminal: None,
            get,
            set,
            get_reals,
            set_reals,
        }
    }

    /// Sets the smallest permitted value.
    pub const fn min(mut self, min: f64) -> Self {
        self.min = Some(min);
        self
    }

    /// Sets the largest permitted value.
    pub const fn max(mut self, max: f64) -> Self {
        self.max = Some(max);
        self
    }

    /// Sets the typical magnitude.
    pub const fn nominal(mut self, nominal: f64) -> Self {
        self.nominal = Some(nominal);
        self
    }

    /// Makes an integer an enumeration.
    pub const fn items(mut self, items: &'static Enumeration) -> Self {
        self.items = Some(items);
        self
    }

    /// Names the inputs that the value depends on directly.
    pub const fn depends(mut self, depends: &'static [&'static str]) -> Self {
        self.depends = Some(depends);
        self
    }

    /// Names further inputs that the value depends on before the first step.
    pub const fn depends_initially(mut self, depends: &'static [&'static str]) -> Self {
        self.depends_initially = depends;
        self
    }

    /// Offers the unit's display unit or not.
    pub const fn display(mut self, display: bool) -> Self {
        self.display = display;
        self
    }

    /// Declares that a Real changes only at certain instants.
    pub const fn discrete(mut self, discrete: bool) -> Self {
        self.discrete = discrete;
        self
    }

    /// Names the terminal that the variable belongs to.
    pub const fn terminal(mut self, terminal: &'static str) -> Self {
        self.terminal = Some(terminal);
        self
    }

    /// Declares whether reading needs `Model::refresh` first.
    pub const fn lazy(mut self, lazy: bool) -> Self {
        self.lazy = lazy;
        self
    }
}

/// All variables of a model; a value reference is the position among the flattened rows.
pub struct Table<M: 'static> {
    /// The declarations, in order.
    pub rows: &'static [Row<M>],
    places: &'static [Place],
    // Inside the table, because a static of a generic function would be shared by all models.
    pub(crate) guid: OnceLock<[u8; guid::LEN]>,
}

impl<M> Table<M> {
    #[doc(hidden)]
    pub const fn new(rows: &'static [Row<M>], places: &'static [Place]) -> Self {
        Self { rows, places, guid: OnceLock::new() }
    }

    /// Number of variables, each element of an array counted.
    #[must_use]
    pub const fn len(&self) -> usize {
        self.places.len()
    }

    /// Whether there is no variable.
    #[must_use]
    pub const fn is_empty(&self) -> bool {
        self.places.is_empty()
    }

    /// The row and the element that a value reference points at.
    #[inline]
    #[must_use]
    pub fn lookup(&self, reference: u32) -> Option<(&'static Row<M>, usize)> {
        let place = self.places.get(reference as usize)?;
        Some((&self.rows[usize::from(place.row)], usize::from(place.element)))
    }

    /// Every variable with its value reference, in order.
    pub fn variables(&self) -> impl Iterator<Item = (u32, &'static Row<M>, usize)> + '_ {
        (0..).map_while(|reference| self.lookup(reference).map(|(row, element)| (reference, row, element)))
    }

    /// Value reference of the variable with this name, the index included: `kappa_ref[1]`.
    #[must_use]
    pub fn find(&self, name: &str) -> Option<u32> {
        self.variables().find(|(_, row, element)| row.element_name(*element) == name).map(|(reference, ..)| reference)
    }
}

impl<M> Row<M> {
    /// Name of an element as importers see it; arrays count from 1.
    #[must_use]
    pub fn element_name(&self, element: usize) -> String {
        match self.len {
            None => self.name.to_owned(),
            Some(_) => format!("{}[{}]", self.name, element + 1),
        }
    }

    /// Current value of an element.
    #[must_use]
    pub fn read<'a>(&self, model: &'a M, element: usize) -> Scalar<'a> {
        (self.get)(model, element)
    }
}
