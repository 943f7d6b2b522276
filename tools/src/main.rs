//! The program `fmu`, run as `cargo fmu`.

use std::io::Write;
use std::process::ExitCode;

use clap::Parser;

fn main() -> ExitCode {
    match fmu_tools::Cli::parse().run() {
        Ok(code) => code,
        Err(error) => {
            let _closed = writeln!(std::io::stderr().lock(), "error: {error:#}");
            ExitCode::FAILURE
        }
    }
}
