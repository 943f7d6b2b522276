//! Files of recorded quadratic programmes; the format is in `fmu-controller/lpv-mpc/benches/qp/README.md`.

use std::path::{Path, PathBuf};

use anyhow::{Context, Result, bail, ensure};
use lpv_mpc::qp;

/// Number of states of the recorded problems.
pub const NX: usize = 5;
/// Number of inputs.
pub const NU: usize = 2;
/// Values in front of the records.
const HEADER: usize = 26;
/// Lateral error, the state with the soft bound.
const E_Y: usize = 3;

/// A recorded problem.
pub type Problem = qp::Problem<NX, NU>;

/// Consecutive problems of one closed loop.
#[derive(Clone, Debug)]
pub struct File {
    /// Where they come from.
    pub path: PathBuf,
    /// Samples of each problem's horizon.
    pub horizon: usize,
    /// The problems in the order of time.
    pub problems: Vec<Problem>,
}

impl File {
    /// Reads a file.
    pub fn read(path: &Path) -> Result<Self> {
        let bytes = std::fs::read(path).with_context(|| format!("cannot read {}", path.display()))?;
        Self::parse(path, &bytes).with_context(|| format!("{} is no file of recorded problems", path.display()))
    }

    /// The name without folder and ending.
    pub fn name(&self) -> String {
        self.path.file_stem().map(|name| name.to_string_lossy().into_owned()).unwrap_or_default()
    }

    fn parse(path: &Path, bytes: &[u8]) -> Result<Self> {
        ensure!(bytes.len().is_multiple_of(8), "its length {} is no multiple of 8", bytes.len());
        let (words, _) = bytes.as_chunks::<8>();
        let values: Vec<f64> = words.iter().map(|word| f64::from_le_bytes(*word)).collect();
        let Some((header, records)) = values.split_at_checked(HEADER) else {
            bail!("it holds {} values, fewer than the {HEADER} of its header", values.len());
        };
        ensure!(header[0] == 1.0, "its version is {:e}, not 1", header[0]);
        let horizon = whole("horizon", header[1], 80)?;
        let count = whole("number of records", header[2], 10_000_000)?;
        let length = NX + NU + 2 + 2 * (horizon + 1) + (NX + NU) * horizon + NX * (NX + NU) * horizon;
        ensure!(
            records.len() == count * length,
            "{count} records of {length} values are promised, {} values are there",
            records.len()
        );
        let problems = records.chunks_exact(length).map(|record| problem(header, record, horizon)).collect();
        Ok(Self { path: path.to_path_buf(), horizon, problems })
    }
}

fn whole(what: &str, value: f64, most: usize) -> Result<usize> {
    (1..=most).find(|n| *n as f64 == value).with_context(|| format!("its {what} is {value}, not 1 to {most}"))
}

fn problem(header: &[f64], record: &[f64], horizon: usize) -> Problem {
    let mut problem = Problem::new(horizon);
    problem.q.copy_from_slice(&header[6..11]);
    problem.q_terminal.set_diagonal(&nalgebra::SVector::<f64, NX>::from_column_slice(&header[11..16]));
    problem.r.copy_from_slice(&header[16..18]);
    problem.u_min.copy_from_slice(&header[18..20]);
    problem.u_max.copy_from_slice(&header[20..22]);
    problem.du_max.copy_from_slice(&header[22..24]);
    (problem.soft_state, problem.soft_bound, problem.soft) = (E_Y, header[24], header[25]);
    problem.x_0.copy_from_slice(&record[..NX]);
    problem.u_prev.copy_from_slice(&record[NX..NX + NU]);
    let speeds = &record[NX + NU + 2 + horizon + 1..][..horizon + 1];
    let models = &record[NX + NU + 2 + 2 * (horizon + 1) + (NX + NU) * horizon..];
    for (i, (stage, model)) in problem.stages.iter_mut().zip(models.chunks_exact(NX * (NX + NU))).enumerate() {
        stage.x_ref[0] = speeds[i + 1];
        stage.A = nalgebra::SMatrix::from_row_slice(&model[..NX * NX]);
        stage.B = nalgebra::SMatrix::from_row_slice(&model[NX * NX..]);
    }
    problem
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn damaged_files_are_refused_with_what_is_wrong() {
        let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../fmu-controller/lpv-mpc/benches/qp/gen10.bin");
        let good = std::fs::read(&path).unwrap();
        assert_eq!(File::parse(&path, &good).unwrap().problems.len(), 30);
        let mut version = good.clone();
        version[..8].copy_from_slice(&2.0f64.to_le_bytes());
        let mut horizon = good.clone();
        horizon[8..16].copy_from_slice(&f64::NAN.to_le_bytes());
        let cases: [(&[u8], &str); 5] = [
            (&good[..good.len() - 3], "no multiple of 8"),
            (&good[..80], "fewer than the 26"),
            (&good[..good.len() - 8], "are promised"),
            (&version, "version is 2e0"),
            (&horizon, "horizon is NaN"),
        ];
        for (bytes, message) in cases {
            let error = File::parse(&path, bytes).unwrap_err().to_string();
            assert!(error.contains(message), "got {error:?}, want {message:?}");
        }
    }
}
