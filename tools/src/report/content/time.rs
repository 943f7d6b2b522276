//! What a sample costs.

use lpv_mpc::Parameters;

use super::{Findings, numbers};
use crate::baselines::Baseline;
use crate::plots::{Chart, Curve, Page, chart};
use crate::report::runs::{Nonlinear, Who};
use crate::report::timing::quantile;

/// The section.
pub fn section(page: &mut Page, findings: &Findings) {
    page.section("time", "Computing time");
    page.text(
        "One sample on the general track, on the machine that made this page; the nonlinear MPC was timed when its runs were \
         made. The paper reports 11 ms (a laptop, Yalmip and Gurobi) for a period of 33 ms.\n",
    );
    let mut rows = vec![["", "median [\u{b5}s]", "99 % [\u{b5}s]", "largest [\u{b5}s]"].map(str::to_owned).to_vec()];
    rows.push(["paper, mean", "11000", "-", "-"].map(str::to_owned).to_vec());
    for (who, times) in &findings.times {
        let mut row = vec![who.name().to_owned()];
        row.extend([0.5, 0.99, 1.0].map(|share| format!("{:.2}", 1e6 * quantile(times, share))));
        rows.push(row);
    }
    page.markup(&numbers(&rows));
    let t_s = Parameters::paper().t_s;
    let shown = [Who::Ours, Who::Nonlinear(Nonlinear::Foreseen), Who::Baseline(Baseline::LinearMeasured)];
    let curves = shown.iter().map(|who| {
        let times = findings.times(*who);
        let t: Vec<f64> = (0..times.len()).map(|k| t_s * k as f64).collect();
        Curve::new(who.name(), &t, times.iter().map(|time| 1e6 * time).collect(), who.color())
    });
    page.chart(
        &chart(
            [
                "time-over-time",
                "Computing time over the track",
                "As the paper's figure 11; its own mean is 11 000 \u{b5}s.",
            ],
            ["time [s]", "one sample [\u{b5}s]"],
            curves.collect(),
        )
        .log_y(),
    );
    page.chart(&distribution(findings, &shown));
}

/// Share of the samples that take at most a time.
fn distribution(findings: &Findings, shown: &[Who]) -> Chart {
    let curves = shown.iter().map(|who| {
        let mut times: Vec<f64> = findings.times(*who).iter().map(|time| 1e6 * time).collect();
        times.sort_by(f64::total_cmp);
        let share: Vec<f64> = (1..=times.len()).map(|k| 100.0 * k as f64 / times.len() as f64).collect();
        Curve::new(who.name(), &times, share, who.color())
    });
    chart(
        ["time-distribution", "Distribution of the computing time", "Share of the samples that take at most so long."],
        ["one sample [\u{b5}s]", "share of the samples [%]"],
        curves.collect(),
    )
    .log_x()
}
