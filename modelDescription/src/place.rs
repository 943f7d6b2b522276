//! Where value references point: the rows, flattened to one place for each element.

use crate::table::Row;

/// Where a value reference points: a row and an element of it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Place {
    pub(crate) row: u16,
    pub(crate) element: u16,
}

#[doc(hidden)]
pub const fn count<M>(rows: &[Row<M>]) -> usize {
    let mut total = 0;
    let mut row = 0;
    while row < rows.len() {
        total += elements(&rows[row]);
        row += 1;
    }
    total
}

#[doc(hidden)]
#[expect(clippy::cast_possible_truncation, reason = "both counts are compared with u16::MAX first")]
pub const fn flatten<M, const LEN: usize>(rows: &[Row<M>]) -> [Place; LEN] {
    assert!(LEN <= u16::MAX as usize, "a table holds at most 65535 variables");
    let mut places = [Place { row: 0, element: 0 }; LEN];
    let (mut next, mut row) = (0, 0);
    while row < rows.len() {
        let mut element = 0;
        while element < elements(&rows[row]) {
            places[next] = Place { row: row as u16, element: element as u16 };
            next += 1;
            element += 1;
        }
        row += 1;
    }
    places
}

const fn elements<M>(row: &Row<M>) -> usize {
    match row.len {
        None => 1,
        Some(len) => len,
    }
}
