//! What does a solve of the quadratic programme cost, with nothing active, at the limit, saturated, and on a long horizon?
#![allow(non_snake_case, reason = "matrices keep the paper's capitals")]
#![allow(missing_docs, reason = "the macros make undocumented functions")]

use std::hint::black_box;

use criterion::{Criterion, criterion_group, criterion_main};
use lpv_mpc::qp::{Clarabel, Problem, Solution, Structured};
use nalgebra::{SMatrix, SVector};

/// Problems of a recorded file; the format is in `benches/qp/README.md`.
fn recorded(bytes: &[u8]) -> Vec<Problem<5, 2>> {
    let (words, _) = bytes.as_chunks::<8>();
    let values: Vec<f64> = words.iter().map(|word| f64::from_le_bytes(*word)).collect();
    let (header, records) = values.split_at(26);
    let N = (1..=80usize).find(|n| *n as f64 == header[1]).expect("the committed files have horizons up to 80");
    let parse = |record: &[f64]| {
        let mut problem = Problem::<5, 2>::new(N);
        problem.q.copy_from_slice(&header[6..11]);
        problem.q_terminal.set_diagonal(&SVector::<f64, 5>::from_column_slice(&header[11..16]));
        problem.r.copy_from_slice(&header[16..18]);
        problem.u_min.copy_from_slice(&header[18..20]);
        problem.u_max.copy_from_slice(&header[20..22]);
        problem.du_max.copy_from_slice(&header[22..24]);
        (problem.soft_state, problem.soft_bound, problem.soft) = (3, header[24], header[25]);
        problem.x_0.copy_from_slice(&record[..5]);
        problem.u_prev.copy_from_slice(&record[5..7]);
        let models = record[9 + 2 * (N + 1) + 7 * N..].chunks_exact(35);
        for (i, (stage, model)) in problem.stages.iter_mut().zip(models).enumerate() {
            stage.x_ref[0] = record[9 + N + 2 + i];
            stage.A = SMatrix::from_row_slice(&model[..25]);
            stage.B = SMatrix::from_row_slice(&model[25..]);
        }
        problem
    };
    records.chunks_exact(9 + 2 * (N + 1) + 42 * N).map(parse).collect()
}

fn solvers(criterion: &mut Criterion) {
    let files: [(&str, &[u8]); 4] = [
        ("nothing active", include_bytes!("qp/gen10.bin")),
        ("at the limit", include_bytes!("qp/dlc15.bin")),
        ("saturated", include_bytes!("qp/sat1.bin")),
        ("long horizon", include_bytes!("qp/dlc15n40.bin")),
    ];
    for (name, bytes) in files {
        let problems = recorded(bytes);
        let N = problems[0].stages.len();
        let mut solution = Solution::new(N);
        let mut group = criterion.benchmark_group(name);
        // One turn is the whole excerpt, so that warm starts are what they are in a loop.
        group.throughput(criterion::Throughput::Elements(problems.len() as u64));
        let mut structured = Structured::new(N);
        group.bench_function("structured", |bencher| {
            bencher.iter(|| {
                for problem in &problems {
                    structured.shift();
                    structured.solve(black_box(problem), &mut solution);
                }
            });
        });
        let mut clarabel = Clarabel::new(1e-8);
        group.bench_function("clarabel", |bencher| {
            bencher.iter(|| {
                for problem in &problems {
                    clarabel.solve(black_box(problem), &mut solution);
                }
            });
        });
        group.finish();
    }
}

criterion_group!(benches, solvers);
criterion_main!(benches);
