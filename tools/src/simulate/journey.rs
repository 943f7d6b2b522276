//! Whether a run gets anywhere: one that does not is given up, and what is printed of it says so.

use anyhow::{Result, ensure};
use vehicle::{Road, Vehicle};

use crate::recording::{Recording, Tracking};

/// Lateral error beyond which a car has left the road [m].
pub const ROAD: f64 = 2.0;
/// Time without progress after which a run is given up [s].
const PATIENCE: f64 = 60.0;
/// Way that counts as progress [m]: far more than a controller moves that holds a car at its place.
const PROGRESS: f64 = 0.1;
/// Samples that a run may keep: some 2 GB.
const SAMPLES_MAX: f64 = 1e7;

/// How far a car has come, and since when it has come no further.
#[derive(Clone, Copy, Debug)]
pub struct Progress {
    s: f64,
    since: f64,
}

impl Default for Progress {
    fn default() -> Self {
        Self { s: f64::NEG_INFINITY, since: 0.0 }
    }
}

impl Progress {
    /// Takes in the way `s` [m] at a time `t` [s]; `false` once a minute has brought nothing.
    pub fn goes_on(&mut self, t: f64, s: f64) -> bool {
        if s > self.s + PROGRESS {
            *self = Self { s, since: t };
        }
        t - self.since < PATIENCE
    }
}

/// Way to drive until the end of the road [m].
pub fn way(plant: &Vehicle) -> f64 {
    let road = plant.road();
    if road.is_closed() { road.length() * f64::from(plant.parameters().laps) } else { road.length() }
}

/// Time that the reference takes for that way [s].
pub fn time(plant: &Vehicle) -> f64 {
    plant.road().duration() * way(plant) / plant.road().length()
}

/// Refuses, before it begins, a run to the end of a road that cannot get there, and a run of more samples than can be kept.
pub fn possible(plant: &Vehicle, step: f64, stop: Option<f64>) -> Result<()> {
    if let Some(stop) = stop {
        ensure!(stop > 0.0 && stop.is_finite(), "the end of the run, --stop, must be above 0 s, got {stop}");
    } else {
        ensure!(
            wanted_somewhere(plant.road()),
            "the wanted speed is 0 on the whole road, so the car never arrives: set plant.speed above 0 (in a \
             file the column v_x), or say by --stop how long it shall stand"
        );
    }
    let samples = stop.unwrap_or_else(|| time(plant)) / step;
    ensure!(
        samples <= SAMPLES_MAX,
        "{:.0} s at steps of {step} s are {samples:.0} samples, more than the {SAMPLES_MAX} that are kept: take a \
         longer --step or an earlier --stop",
        stop.unwrap_or_else(|| time(plant)),
    );
    Ok(())
}

fn wanted_somewhere(road: &Road) -> bool {
    let places = 1000;
    (0..=places).any(|i| road.speed(road.length() * f64::from(i) / f64::from(places)) > 0.0)
}

/// What must be said of a run before its figures are read: that it did not get to the end, `way` [m], and that it left the road.
///
/// `stopped` tells that its end was asked for by time.
pub fn remarks(run: &Recording, way: f64, stopped: bool) -> Vec<String> {
    let (t, s) = (run.column("t"), run.column("s"));
    let (Some(&end), Some(&came)) = (t.last(), s.last()) else { return Vec::new() };
    let mut remarks = Vec::new();
    if !stopped && came < way {
        let mut progress = Progress::default();
        let stuck = !t.iter().zip(&s).all(|(&t, &s)| progress.goes_on(t, s));
        let why = if stuck {
            format!("no progress for {PATIENCE} s, the speed wanted there is {:.2} m/s", last(run, "v_x_ref[1]"))
        } else {
            "twice the time that the road takes".to_owned()
        };
        remarks.push(format!(
            "The end of the road was not reached: given up at {came:.1} m of {way:.0} m after {end:.2} s, {why}."
        ));
    }
    let e_y = Tracking::of(run).e_y_max;
    if e_y.is_nan() || e_y > ROAD {
        remarks.push(format!("Off the road: the car was {e_y:.1} m from the path, more than {ROAD} m."));
    }
    remarks
}

fn last(run: &Recording, name: &str) -> f64 {
    run.column(name).last().copied().unwrap_or_default()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::simulate::build;
    use crate::simulate::native::drive_while;
    use crate::simulate::settings::Settings;

    fn drive(road: &str, step: f64, assignments: &[&str]) -> (Recording, f64) {
        let assignments: Vec<String> = assignments.iter().map(|&text| text.to_owned()).collect();
        let (mut plant, mut controller) = build(&Settings::new(road, &assignments).unwrap()).unwrap();
        let mut progress = Progress::default();
        let goes_on = |t, s| progress.goes_on(t, s);
        let run = drive_while(&mut plant, &mut controller, step, None, |_, _, _| {}, goes_on).unwrap();
        (run, way(&plant))
    }

    #[test]
    fn a_run_to_the_end_of_its_road_needs_no_remark() {
        let (run, way) = drive("double_lane_change", 0.033, &[]);
        assert_eq!(remarks(&run, way, false), Vec::<String>::new());
        // Laps count: twice the time of one lap would end three of them early.
        let (run, way) = drive("circuit", 0.033, &["plant.laps=3"]);
        assert_eq!(remarks(&run, way, false), Vec::<String>::new());
    }

    #[test]
    fn a_run_that_leaves_its_road_says_so() {
        // An actuator that the controller does not know of.
        let (run, way) = drive("double_lane_change", 0.001, &["plant.delta_rate_max=0.02"]);
        let said = remarks(&run, way, false).join("\n");
        assert!(said.contains("was not reached: given up at ") && said.contains(" m of 200 m after 28."), "{said}");
        assert!(said.contains("Off the road: the car was "), "{said}");
        assert!(!remarks(&run, way, true).join("\n").contains("not reached"), "who asks for a time gets a time");
    }

    #[test]
    fn a_car_that_stands_before_the_end_is_given_up() {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("stop.csv");
        std::fs::write(&file, "s,kappa,v_x\n0,0,10\n50,0,10\n90,0,0\n200,0,0\n").unwrap();
        let (run, way) = drive(file.to_str().unwrap(), 0.033, &[]);
        let said = remarks(&run, way, false).join("\n");
        assert!(said.contains(" m of 200 m after ") && said.contains("no progress for 60 s"), "{said}");
        assert!(last(&run, "t") < 200.0, "{} s", last(&run, "t"));
    }

    #[test]
    fn a_run_that_cannot_end_is_refused() {
        let refusal = |assignment: &str, stop| {
            let (plant, _) = build(&Settings::new("straight", &[assignment.to_owned()]).unwrap()).unwrap();
            possible(&plant, 0.001, stop).err().map(|error| error.to_string())
        };
        assert!(refusal("plant.speed=0", None).unwrap().contains("plant.speed"));
        assert!(refusal("plant.speed=0", Some(5.0)).is_none());
        assert!(refusal("plant.speed=9", None).is_none());
        assert!(refusal("plant.speed=9", Some(1e9)).unwrap().contains("1000000000000 samples"));
        assert!(refusal("plant.speed=9", Some(-3.0)).unwrap().contains("above 0 s, got -3"));
    }
}
