//! Messages to the importer's logger.

use std::ffi::{CStr, CString};

use super::c::{Callbacks, Environment, LoggerFunction, Status};
use crate::error::Error;
use crate::model::{Category, Log};

/// The importer's logger and what it wants to hear.
pub struct Logger {
    function: Option<LoggerFunction>,
    environment: Environment,
    instance: CString,
    debug: bool,
    /// The categories that fmi2SetDebugLogging named; None: all.
    chosen: Option<[bool; Category::ALL.len()]>,
}

// SAFETY: environment is passed back to the importer and never dereferenced; FMI 2.0.4, section 2.1.5 leaves it to the importer
// to call one instance from one thread at a time, and the logger is only called from inside such a call.
unsafe impl Send for Logger {}

impl Logger {
    pub(super) fn instance_name(&self) -> &CStr {
        &self.instance
    }

    pub(super) fn new(callbacks: &Callbacks, instance: CString, debug: bool) -> Self {
        Self { function: callbacks.logger, environment: callbacks.environment, instance, debug, chosen: None }
    }

    /// fmi2SetDebugLogging; no category means all of them.
    pub(super) fn choose(&mut self, debug: bool, categories: &[&str]) -> Result<(), Error> {
        let mut chosen = [false; Category::ALL.len()];
        for &name in categories {
            let known = Category::ALL.iter().zip(&mut chosen);
            let mut found = name == Category::EVERYTHING;
            for (category, chosen) in known {
                if name == category.name() || name == Category::EVERYTHING {
                    *chosen = true;
                    found = true;
                }
            }
            if !found {
                return Err(Error::Category(name.to_owned()));
            }
        }
        self.debug = debug;
        self.chosen = (debug && !categories.is_empty()).then_some(chosen);
        Ok(())
    }

    fn send(&self, category: Category, message: &str) {
        let Some(logger) = self.function else { return };
        let status = match category {
            Category::Event => Status::Ok,
            Category::Warning => Status::Warning,
            Category::Error => Status::Error,
        };
        let message = c_format(message);
        let name = category.c_name();
        // SAFETY: FMI 2.0.4, section 2.1.5: logger takes NUL-terminated strings that it copies if it keeps them, and a printf
        // format; every % is doubled, so the format consumes no further argument.
        unsafe { logger(self.environment, self.instance.as_ptr(), status, name.as_ptr(), message.as_ptr()) };
    }
}

impl Log for Logger {
    fn enabled(&self, category: Category) -> bool {
        let chosen = self.chosen.is_none_or(|chosen| chosen[category as usize]);
        self.function.is_some()
            && match category {
                Category::Event => self.debug && chosen,
                // A warning explains a status that the importer gets anyway, so it does not depend on debug logging.
                Category::Warning => chosen,
                Category::Error => true,
            }
    }

    fn log(&mut self, category: Category, message: &str) {
        if self.enabled(category) {
            self.send(category, message);
        }
    }
}

impl Category {
    fn c_name(self) -> &'static CStr {
        match self {
            Category::Event => c"logEvents",
            Category::Warning => c"logStatusWarning",
            Category::Error => c"logStatusError",
        }
    }
}

/// The message as a format that prints itself: importers whose logger ignores the variadic arguments would show "%s" otherwise.
fn c_format(message: &str) -> CString {
    CString::new(message.replace('%', "%%").replace('\0', " ")).expect("every NUL was replaced")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_percent_sign_survives_printf() {
        assert_eq!(c_format("100 % of %s\0%n").to_str().unwrap(), "100 %% of %%s %%n");
    }

    #[test]
    fn categories_have_one_name() {
        for category in Category::ALL {
            assert_eq!(category.c_name().to_str().unwrap(), category.name());
        }
    }
}
