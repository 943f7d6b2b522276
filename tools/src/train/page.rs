//! The page of a training or of an evaluation: scores, the learning curve, predicted against true stiffness over time.

use lpv_mpc::jordan::Network;

use super::data::Run;
use super::evaluate::{HEAD, Report, row};
use super::manoeuvre::Class;
use super::recipe::T_S;
use super::score;
use crate::html::{escape, table};
use crate::plots::{BLUE, Chart, Curve, GREEN, ORANGE, RED, assemble, chart};

/// Units of the columns of [`HEAD`].
const UNITS: [&str; HEAD.len()] = {
    let (stiffness, force) = (" [kN/rad]", " [%]");
    ["", "", "", stiffness, stiffness, stiffness, stiffness, force, force, force, force]
};

/// Stands for the charts' names in the page's script, one for each class.
const IDS: [&str; 6] = ["class_a", "class_b", "class_c", "class_d", "class_e", "class_f"];

/// The page of a training.
pub fn training(report: &Report, held_out: &[Run], network: &Network, curve: &[(usize, f64, f64)]) -> String {
    let steps: Vec<f64> = curve.iter().map(|(step, ..)| *step as f64).collect();
    // Errors span decades; their logarithm is what can be read.
    let decades =
        |pick: fn(&(usize, f64, f64)) -> f64| curve.iter().map(|point| pick(point).log10()).collect::<Vec<f64>>();
    let learning = chart(
        ["learning", "Learning curve", "Mean squared error in units of the stiffness' variance, as a power of ten."],
        ["step", "log10 of the error"],
        vec![
            Curve::new("training", &steps, decades(|point| point.1), BLUE),
            Curve::new("validation", &steps, decades(|point| point.2), ORANGE),
        ],
    );
    whole("Training of the Jordan network", report, held_out, network, vec![learning])
}

/// The page of an evaluation.
pub fn scores(report: &Report, held_out: &[Run], network: &Network) -> String {
    whole("Scores of the Jordan network", report, held_out, network, Vec::new())
}

fn whole(title: &str, report: &Report, held_out: &[Run], network: &Network, mut charts: Vec<Chart>) -> String {
    let names: Vec<String> = HEAD.iter().zip(UNITS).map(|(name, unit)| format!("{name}{unit}")).collect();
    let head: Vec<(&str, bool)> = names.iter().enumerate().map(|(i, name)| (name.as_str(), i > 0)).collect();
    let mut above = String::new();
    let mut section = |title: &str, rows: Vec<Vec<String>>| {
        let cells: Vec<Vec<String>> = rows.iter().map(|row| row.iter().map(|cell| escape(cell)).collect()).collect();
        above.push_str(&format!("<h2>{}</h2>\n{}", escape(title), table(&head, &cells)));
    };
    for set in &report.sets {
        // Sets are named one below the other: the second goes on where the first ends.
        let name = if set.name == "beyond" { "beyond 90 % of grip" } else { set.name };
        section(
            &format!("Held-out manoeuvres {name}"),
            set.rows.iter().map(|(name, score)| row(name, score)).collect(),
        );
    }
    section(
        "Parts of those within 90 % of grip, free-running",
        report.bands.iter().map(|(name, score)| row(name, score)).collect(),
    );
    for (class, id) in Class::ALL.into_iter().zip(IDS) {
        charts.extend(
            held_out
                .iter()
                .find(|run| run.manoeuvre.class == class)
                .map(|run| over_time(run, network, [id, class.name()])),
        );
    }
    let made = &network.document().provenance;
    let [lowest, highest] = made.mu;
    let friction = if lowest == highest { lowest.to_string() } else { format!("{lowest} to {highest}") };
    let lead = format!(
        "Tyre {}, friction {friction}; {}. The manoeuvres took no part in the training. RMSE and worst are errors of the \
         stiffness, force is the rms error of the lateral force over the axle's grip.",
        made.tyre, made.recipe
    );
    assemble(title, &lead, &above, &charts)
}

/// True and predicted stiffness of a run.
fn over_time(run: &Run, network: &Network, [id, title]: [&'static str; 2]) -> Chart {
    let t: Vec<f64> = (1..=run.samples.len()).map(|k| T_S * k as f64).collect();
    let answers = score::free_running(network, run);
    let truth = |axle: usize| run.samples.iter().map(|sample| sample.c[axle] * 1e-3).collect();
    let answer = |axle: usize| answers.iter().map(|c| c[axle] * 1e-3).collect();
    chart(
        [id, title, "A held-out manoeuvre; the network runs on its own answers from the nominal stiffness on."],
        ["time [s]", "stiffness [kN/rad]"],
        vec![
            Curve::new("front", &t, truth(0), BLUE),
            Curve::new("front, network", &t, answer(0), ORANGE).dashed(),
            Curve::new("rear", &t, truth(1), GREEN),
            Curve::new("rear, network", &t, answer(1), RED).dashed(),
        ],
    )
}
