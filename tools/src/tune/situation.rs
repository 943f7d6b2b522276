//! What a candidate has to drive: one manoeuvre, or one manoeuvre under everything that a real car does to it.

use serde::{Deserialize, Serialize};

/// One closed loop.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Situation {
    /// What is particular about it.
    pub name: String,
    /// Manoeuvre or road file.
    pub road: String,
    /// Parameters as `side.name=value`.
    pub assignments: Vec<String>,
}

impl Situation {
    fn new(road: &str, name: &str, assignments: &[&str]) -> Self {
        Self {
            name: name.to_owned(),
            road: road.to_owned(),
            assignments: assignments.iter().map(|&text| text.to_owned()).collect(),
        }
    }

    /// Name with the road.
    pub fn title(&self) -> String {
        format!("{}, {}", self.road, self.name)
    }
}

/// The manoeuvre as it is.
pub fn plain(road: &str) -> Vec<Situation> {
    vec![Situation::new(road, "as modelled", &[])]
}

/// The manoeuvre with delays and lags that the controller knows in part, noise, less friction, gusts, and at other speeds.
///
/// Sizes are those of road cars: steering actuators with 0.05 to 0.15 s of lag and up to 0.1 s of delay, [Rajamani, chapter 12]; the
/// sensors' own standard deviations; a wet road; a storm's gusts from the side.
pub fn ensemble(road: &str) -> Vec<Situation> {
    vec![
        Situation::new(road, "as modelled", &[]),
        Situation::new(
            road,
            "50 ms of delay, 30 assumed",
            &["plant.delay_delta=0.05", "plant.delay_a_x=0.05", "controller.input_delay=0.03"],
        ),
        Situation::new(road, "steering lag 0.1 s", &["plant.tau_delta=0.1", "controller.tau_delta=0.1"]),
        Situation::new(road, "steering lag 30 ms, none assumed", &["plant.tau_delta=0.03"]),
        Situation::new(road, "sensor noise", &["plant.noise_scale=1", "plant.seed=1"]),
        Situation::new(road, "other noise", &["plant.noise_scale=1", "plant.seed=2"]),
        Situation::new(road, "friction 0.6 at 11 m/s", &["plant.mu=0.6", "plant.speed=11"]),
        Situation::new(road, "gust of 20 m/s", &["plant.gust_speed=20", "plant.gust_start=3"]),
        Situation::new(road, "8 m/s", &["plant.speed=8"]),
        Situation::new(road, "16 m/s", &["plant.speed=16"]),
    ]
}

/// Roads that no tuning sees, unless it is asked to.
const UNSEEN: [&str; 3] = ["iso_3888_1", "circuit", "general"];

/// What a tuned set is judged by: other roads; with `robust` also under disturbances of other sizes and seeds.
pub fn held_out(road: &str, robust: bool) -> Vec<Situation> {
    let mut list: Vec<Situation> = UNSEEN.into_iter().filter(|unseen| *unseen != road).flat_map(plain).collect();
    let change = "double_lane_change";
    if road == change {
        list.push(Situation::new(change, "10 m/s", &["plant.speed=10"]));
        list.push(Situation::new(change, "15 m/s", &["plant.speed=15"]));
    }
    if robust {
        let iso = "iso_3888_1";
        list.extend([
            Situation::new(
                iso,
                "40 ms of delay, 25 assumed",
                &["plant.delay_delta=0.04", "plant.delay_a_x=0.04", "controller.input_delay=0.025"],
            ),
            Situation::new(iso, "steering lag 0.08 s", &["plant.tau_delta=0.08", "controller.tau_delta=0.08"]),
            Situation::new(iso, "sensor noise", &["plant.noise_scale=1", "plant.seed=11"]),
            Situation::new("circuit", "sensor noise", &["plant.noise_scale=1", "plant.seed=12"]),
            Situation::new(iso, "friction 0.7", &["plant.mu=0.7"]),
            Situation::new(iso, "gust of 15 m/s", &["plant.gust_speed=-15", "plant.gust_start=2.5"]),
        ]);
    }
    list
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::simulate::build;
    use crate::simulate::settings::Settings;

    #[test]
    fn every_situation_can_be_built() {
        let all = ensemble("double_lane_change").into_iter().chain(held_out("double_lane_change", true));
        for Situation { name, road, assignments } in all {
            assert!(build(&Settings::new(&road, &assignments).unwrap()).is_ok(), "{road}, {name}");
        }
    }

    #[test]
    fn nothing_is_judged_by_what_it_was_tuned_on() {
        for road in ["double_lane_change", "iso_3888_2", "general"] {
            for (seen, robust) in [(plain(road), false), (ensemble(road), true)] {
                let unseen = held_out(road, robust);
                assert!(seen.iter().all(|one| {
                    !unseen.iter().any(|other| one.road == other.road && one.assignments == other.assignments)
                }));
                assert!(unseen.len() >= 2);
            }
        }
    }
}
