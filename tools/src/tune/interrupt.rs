//! Ctrl-C: the first ends the work in hand and saves it, the second ends the program. The only file that knows the ctrlc crate.

use std::sync::OnceLock;
use std::sync::atomic::{AtomicBool, Ordering};

use anyhow::{Context, Result};

/// What a shell expects of a program that was interrupted: 128 and the signal's number.
pub const INTERRUPTED: u8 = 130;

/// Whether somebody wants to stop.
#[derive(Debug, Default)]
pub struct Flag(AtomicBool);

impl Flag {
    /// Whether Ctrl-C was pressed.
    pub fn raised(&self) -> bool {
        self.0.load(Ordering::Relaxed)
    }
}

/// The flag; the first call takes Ctrl-C over from the system.
///
/// # Errors
/// If the system refuses.
pub fn flag() -> Result<&'static Flag> {
    static FLAG: OnceLock<Flag> = OnceLock::new();
    static TAKEN: OnceLock<Result<(), ctrlc::Error>> = OnceLock::new();
    let flag = FLAG.get_or_init(Flag::default);
    let taken = TAKEN.get_or_init(|| {
        ctrlc::set_handler(|| {
            if flag.0.swap(true, Ordering::Relaxed) {
                std::process::exit(i32::from(INTERRUPTED));
            }
        })
    });
    taken.as_ref().map(|()| flag).map_err(|error| anyhow::anyhow!("{error}")).context("taking over Ctrl-C")
}
