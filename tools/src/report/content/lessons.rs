//! The networks: learning curve, scores, and what teacher forcing hides.

use super::numbers;
use crate::plots::{BLUE, Curve, ORANGE, Page, chart};
use crate::report::learning::{Learning, Point};
use crate::train::evaluate;

/// The section.
pub fn section(page: &mut Page, learning: &Learning) {
    page.section("learning", "Learning");
    page.text(
        "Manoeuvres of the plant, split by manoeuvre; the scores are those on manoeuvres that no network saw. The paper reports \
         R\u{b2} of 99.8 % and 99.7 % and does not say whether the network was fed the true previous stiffness. That matters: the \
         same weights can score well on the truth and fail on their own answers, as they are deployed, and where the true previous \
         value alone scores this well, teacher-forced scores say little.\n",
    );
    let head = evaluate::HEAD.map(str::to_owned).to_vec();
    let rows = learning.scores.iter().map(|(name, score)| evaluate::row(name, score));
    page.markup(&numbers(&std::iter::once(head).chain(rows).collect::<Vec<_>>()));
    page.text("Stiffness: RMSE and worst in kN/rad; force: error, rms and worst, in % of the axle's grip.\n");
    let steps: Vec<f64> = learning.curve.iter().map(|(step, ..)| *step as f64).collect();
    let errors = |pick: fn(&Point) -> f64| learning.curve.iter().map(pick).collect::<Vec<f64>>();
    page.chart(
        &chart(
            [
                "learning-curve",
                "Learning curve",
                "A network of the paper's size, trained while this page was made; mean squared error in units of the variance, on \
                 the free run. As the paper's figure 4, whose recipe ends at 0.002 and 0.005 after 100 epochs.",
            ],
            ["step", "mean squared error"],
            vec![
                Curve::new("training", &steps, errors(|point| point.1), BLUE),
                Curve::new("validation", &steps, errors(|point| point.2), ORANGE),
            ],
        )
        .log_y(),
    );
    for chart in &learning.charts {
        page.chart(chart);
    }
}
