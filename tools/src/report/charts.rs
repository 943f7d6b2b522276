//! The figures of one situation: everybody who drove it, in one colour each.

use super::runs::{Run, Situation, Who};
use crate::plots::{BLUE, Chart, Curve, GREEN, GREY, ORANGE, chart};
use crate::recording::Recording;

const TIME: &str = "time [s]";
const DEGREES: f64 = 180.0 / std::f64::consts::PI;

/// Half of what the zoomed trajectory shows along and across the road [m]: two car lengths, and errors that can be told apart.
const AROUND: f64 = 8.0;
const ACROSS: f64 = 0.8;

/// A quantity of a run over its time.
type Quantity<'a> = &'a dyn Fn(&Recording) -> Vec<f64>;

fn scaled(run: &Recording, name: &str, factor: f64) -> Vec<f64> {
    run.column(name).into_iter().map(|value| factor * value).collect()
}

fn speed_error(run: &Recording) -> Vec<f64> {
    run.column("v_x_true").iter().zip(run.column("v_x_ref[1]")).map(|(v_x, wanted)| v_x - wanted).collect()
}

/// The runs of a situation.
pub struct Figure<'a> {
    situation: Situation,
    runs: Vec<&'a Run>,
}

impl<'a> Figure<'a> {
    /// Picks the situation's runs; ours is drawn last, on top of the others.
    pub fn new(situation: Situation, runs: &'a [Run]) -> Self {
        let mut runs: Vec<&Run> = runs.iter().filter(|run| run.situation == situation).collect();
        runs.sort_by_key(|run| run.who == Who::Ours);
        Self { situation, runs }
    }

    fn ours(&self) -> &Recording {
        &self.runs.last().expect("ours drives every situation").recording
    }

    fn id(&self, name: &str) -> String {
        format!("{}-{name}", self.situation.id())
    }

    /// Whether somebody left the road, so that the others need their own scale.
    fn scale(&self, quantity: Quantity<'_>) -> Option<[f64; 2]> {
        if self.runs.iter().all(|run| run.figures.stayed()) {
            return None;
        }
        let stayed = self.runs.iter().filter(|run| run.figures.stayed());
        let values = stayed.flat_map(|run| quantity(&run.recording));
        let (low, high) = values.fold((0.0_f64, 0.0_f64), |(low, high), value| (low.min(value), high.max(value)));
        let margin = 0.1 * (high - low);
        Some([low - margin, high + margin])
    }

    /// A quantity of everybody whom `select` picks.
    fn over_time(
        &self,
        [id, title, note]: [&str; 3],
        axis: &str,
        quantity: Quantity<'_>,
        select: impl Fn(Who) -> bool,
    ) -> Chart {
        let curves = self.runs.iter().filter(|run| select(run.who)).map(|run| {
            let curve =
                Curve::new(run.who.name(), &run.recording.column("t"), quantity(&run.recording), run.who.color());
            if matches!(run.who, Who::Nonlinear(_)) { curve.dashed() } else { curve }
        });
        chart(["", title, note], [TIME, axis], curves.collect()).named(self.id(id)).zoomed(None, self.scale(quantity))
    }

    /// All charts of the situation, in the order of the paper's figures.
    pub fn charts(&self) -> Vec<Chart> {
        let all = |_: Who| true;
        let best = |who: Who| matches!(who, Who::Ours | Who::Nonlinear(_));
        vec![
            self.wind(),
            self.speed(),
            self.trajectory(None),
            self.trajectory(Some(self.sharpest())),
            self.over_time(
                ["steering", "Steering angle", "What the front wheels do. As the paper's figure 9."],
                "delta [deg]",
                &|run| scaled(run, "delta_actual", DEGREES),
                all,
            ),
            self.over_time(
                ["acceleration", "Acceleration", "Drive and brakes."],
                "a_x [m/s\u{b2}]",
                &|run| scaled(run, "a_x_actual", 1.0),
                all,
            ),
            self.over_time(
                ["lateral-velocity", "Lateral velocity", ""],
                "v_y [m/s]",
                &|run| scaled(run, "v_y_true", 1.0),
                all,
            ),
            self.stiffness(),
            self.over_time(
                ["lateral-error", "Lateral error", "Everybody. As the paper's figure 10."],
                "e_y [cm]",
                &|run| scaled(run, "e_y_true", 100.0),
                all,
            ),
            self.over_time(
                [
                    "lateral-error-best",
                    "Lateral error, the best",
                    "Ours and the nonlinear MPC on a scale on which they can be seen.",
                ],
                "e_y [mm]",
                &|run| scaled(run, "e_y_true", 1000.0),
                best,
            ),
            self.over_time(["speed-error", "Speed error", ""], "v_x error [m/s]", &speed_error, all),
            self.over_time(
                [
                    "heading-error",
                    "Heading error",
                    "Heading of the body minus heading of the path: in a curve the body drifts, whoever steers.",
                ],
                "e_psi [deg]",
                &|run| scaled(run, "e_psi_true", DEGREES),
                all,
            ),
            self.over_time(
                [
                    "course-error",
                    "Course error",
                    "Direction of motion minus heading of the path: what a controller can be blamed for.",
                ],
                "course error [deg]",
                &|run| run.course_error().into_iter().map(|value| DEGREES * value).collect(),
                all,
            ),
            self.over_time(
                ["grip", "Grip in use", "Share of what the tyres can give, the worse axle."],
                "grip [%]",
                &|run| scaled(run, "grip_usage", 100.0),
                all,
            ),
        ]
    }

    fn wind(&self) -> Chart {
        let run = self.ours();
        let curve = Curve::new("wind", &run.column("t"), run.column("wind_speed_actual"), GREY);
        chart(
            ["", "Wind", "Against the first heading; it turns relative to the car."],
            [TIME, "wind [m/s]"],
            vec![curve],
        )
        .named(self.id("wind"))
    }

    fn speed(&self) -> Chart {
        let mut curves: Vec<Curve> = self
            .runs
            .iter()
            .map(|run| {
                let t = run.recording.column("t");
                Curve::new(run.who.name(), &t, run.recording.column("v_x_true"), run.who.color())
            })
            .collect();
        let run = self.ours();
        curves.push(Curve::new("wanted", &run.column("t"), run.column("v_x_ref[1]"), GREEN).dotted());
        chart(["", "Speed", "As the paper's figures for wind and speed."], [TIME, "v_x [m/s]"], curves)
            .named(self.id("speed"))
            .zoomed(None, self.scale(&|run| run.column("v_x_true")))
    }

    /// Where the path is sharpest: middle of the zoom [m].
    fn sharpest(&self) -> [f64; 2] {
        let run = self.ours();
        let kappa = run.column("kappa_ref[1]");
        let at = (0..kappa.len()).reduce(|best, i| if kappa[i].abs() > kappa[best].abs() { i } else { best });
        let (x, y) = run.path();
        at.map_or([0.0, 0.0], |i| [x[i], y[i]])
    }

    /// Seen from above; `zoom` is the middle of a part of it.
    fn trajectory(&self, zoom: Option<[f64; 2]>) -> Chart {
        // Only what the part shows, in full resolution: a long road's curve has few points there.
        let part = |x: Vec<f64>, y: Vec<f64>| match zoom {
            None => (x, y),
            Some([middle, _]) => x.into_iter().zip(y).filter(|(x, _)| (x - middle).abs() < 3.0 * AROUND).unzip(),
        };
        let stayed = self.runs.iter().filter(|run| run.figures.stayed());
        let mut curves: Vec<Curve> = stayed
            .map(|run| {
                let [x, y] = ["x", "y"].map(|name| run.recording.column(name));
                let (x, y) = part(x, y);
                Curve::new(run.who.name(), &x, y, run.who.color())
            })
            .collect();
        let (x, y) = self.ours().path();
        let (x, y) = part(x, y);
        curves.push(Curve::new("path", &x, y, GREEN).dotted());
        let (name, title, note) = match zoom {
            None => ("trajectory", "Trajectory", "Seen from above; the axes have different scales."),
            Some(_) => {
                ("zoom", "Trajectory, where the path is sharpest", "Drag to look closer, double-click for more.")
            }
        };
        let chart = chart(["", title, note], ["X [m]", "Y [m]"], curves).named(self.id(name));
        match zoom {
            Some([x, y]) => chart.zoomed(Some([x - AROUND, x + AROUND]), Some([y - ACROSS, y + ACROSS])),
            None => chart,
        }
    }

    fn stiffness(&self) -> Chart {
        let run = self.ours();
        let t = run.column("t");
        let curve = |name: &str, column: &str, color| Curve::new(name, &t, scaled(run, column, 1e-3), color);
        chart(
            [
                "",
                "Cornering stiffness",
                "What the network tells our controller, and what the plant's tyres have. As the paper's figure of stiffnesses.",
            ],
            [TIME, "stiffness [kN/rad]"],
            vec![
                curve("front, true", "c_f_true", BLUE),
                curve("front, network", "c_f", ORANGE).dashed(),
                curve("rear, true", "c_r_true", GREEN),
                curve("rear, network", "c_r", GREY).dashed(),
            ],
        )
        .named(self.id("stiffness"))
    }
}
