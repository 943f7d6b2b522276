//! Parameters that act only together with others: whoever sets one where it does nothing is told so.

use anyhow::Result;
use lpv_mpc::adaptation::other_car;
use lpv_mpc::{Adaptation, Estimation};
use vehicle::{Parameters, Road, tyre::Preset};

use super::settings::Settings;

/// Parameters without effect unless a condition holds.
struct Dependent {
    names: &'static [&'static str],
    acts: fn(&Settings, &Road) -> bool,
    /// The condition as a person reads it.
    unless: &'static str,
}

const fn dependent(
    names: &'static [&'static str],
    acts: fn(&Settings, &Road) -> bool,
    unless: &'static str,
) -> Dependent {
    Dependent { names, acts, unless }
}

const DEPENDENT: [Dependent; 15] = [
    dependent(
        &["plant.tyre_b_f", "plant.tyre_b_r", "plant.tyre_c", "plant.tyre_e"],
        |c, _| c.plant.tyre == Preset::Custom,
        "plant.tyre is custom",
    ),
    dependent(&["plant.h_cg"], |c, _| c.plant.load_transfer, "plant.load_transfer is true"),
    dependent(&["plant.drive_front", "plant.brake_front"], |c, _| c.plant.combined_slip, "plant.combined_slip is true"),
    dependent(&["plant.c_s", "plant.area_side", "plant.arm_side"], |c, _| c.plant.crosswind, "plant.crosswind is true"),
    dependent(
        &["plant.gust_start", "plant.gust_rise", "plant.gust_hold", "plant.gust_direction"],
        |c, _| c.plant.gust_speed != 0.0,
        "plant.gust_speed is other than 0",
    ),
    dependent(
        &["plant.patch_start", "plant.patch_edge", "plant.patch_mu"],
        |c, _| c.plant.patch_length > 0.0,
        "plant.patch_length is above 0",
    ),
    dependent(&["plant.seed"], |c, _| c.plant.noise_scale > 0.0, "plant.noise_scale is above 0"),
    dependent(&["plant.laps"], |_, road| road.is_closed(), "the road is closed, as circuit is"),
    dependent(&["plant.radius"], |c, _| shapes(c, |p| p.radius *= 2.0), "the road is constant_radius"),
    dependent(
        &["plant.steer_amplitude"],
        |_, road| road.steering().is_some(),
        "the road is step_steer or sine_with_dwell",
    ),
    dependent(
        &["plant.speed"],
        |c, _| shapes(c, |p| p.speed += 1.0),
        "the road has no speed of its own, as general, circuit and files have",
    ),
    dependent(
        &["plant.road_tolerance"],
        |c, _| shapes(c, |p| p.road_tolerance += 0.1),
        "the road is a file of points, x,y,v_x",
    ),
    dependent(
        &["plant.width", "plant.overhang_f", "plant.overhang_r"],
        |_, road| !road.cones().is_empty(),
        "the road has cones, as iso_3888_1 and iso_3888_2 have",
    ),
    dependent(
        &["controller.network_file"],
        |c, _| c.controller.adaptation != Adaptation::Constant,
        "controller.adaptation is network_now or network_horizon",
    ),
    dependent(
        &["controller.sensor_noise", "controller.v_y_measured"],
        |c, _| c.controller.estimation == Estimation::Kalman,
        "controller.estimation is kalman",
    ),
];

/// Whether a change of the parameters makes another road.
fn shapes(settings: &Settings, change: fn(&mut Parameters)) -> bool {
    let shape = |p: &Parameters| super::road(&settings.road, p).ok().map(|road| (road.length(), road.duration()));
    let mut other = settings.plant.clone();
    change(&mut other);
    shape(&settings.plant) != shape(&other)
}

/// A remark for each condition that parameters among the `assignments` want and do not have, and for a network that is not used.
///
/// # Errors
/// If the network's file cannot be read.
pub fn remarks(settings: &Settings, road: &Road, assignments: &[String]) -> Result<Vec<String>> {
    let is_set =
        |name: &str| assignments.iter().any(|text| text.split('=').next().is_some_and(|set| set.trim() == name));
    let mut remarks: Vec<String> = DEPENDENT
        .iter()
        .filter(|dependent| !(dependent.acts)(settings, road))
        .filter_map(|Dependent { names, unless, .. }| {
            let idle: Vec<&str> = names.iter().copied().filter(|name| is_set(name)).collect();
            (!idle.is_empty()).then(|| format!("Without effect: {}, unless {unless}.", idle.join(", ")))
        })
        .collect();
    if settings.controller.adaptation != Adaptation::Constant {
        let network = super::network(&settings.network_file)?;
        if let Some(difference) = other_car(&network, &settings.controller) {
            remarks.push(format!(
                "Without effect: controller.adaptation. The network is not of this car, the stiffnesses stay nominal: \
                 {difference}. cargo fmu train --set makes one that is."
            ));
        }
    }
    Ok(remarks)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::simulate::native::drive;
    use crate::simulate::{build, journey};

    /// What a run shows: every sample, the cones hit, and how far it would go.
    fn shown(road: &str, assignments: &[&str]) -> (Vec<crate::recording::Row>, i32, f64) {
        let assignments: Vec<String> = assignments.iter().map(|&text| text.to_owned()).collect();
        let (mut plant, mut controller) = build(&Settings::new(road, &assignments).unwrap()).unwrap();
        let run = drive(&mut plant, &mut controller, 0.033, Some(5.0), |_| {}).unwrap();
        (run.rows, plant.outputs().cones_hit, journey::way(&plant))
    }

    fn said(road: &str, assignments: &[&str]) -> Vec<String> {
        let assignments: Vec<String> = assignments.iter().map(|&text| text.to_owned()).collect();
        let settings = Settings::new(road, &assignments).unwrap();
        remarks(&settings, build(&settings).unwrap().0.road(), &assignments).unwrap()
    }

    #[test]
    fn what_is_said_to_have_no_effect_has_none_and_has_one_where_it_is_said_to() {
        let folder = tempfile::tempdir().unwrap();
        let points = folder.path().join("points.csv");
        let rows: String = (0..40).map(|i| format!("{},{},9\n", 3 * i, f64::from(i % 3) * 0.02)).collect();
        std::fs::write(&points, "x,y,v_x\n".to_owned() + &rows).unwrap();
        let points = points.to_str().unwrap();
        let change = "double_lane_change";
        // Each parameter with a value, where it does nothing, and what makes it act.
        let idle_and_acting = [
            ("plant.tyre_b_f=12", (change, ""), (change, "plant.tyre=custom")),
            ("plant.tyre_b_r=12", (change, ""), (change, "plant.tyre=custom")),
            ("plant.tyre_c=1.6", (change, ""), (change, "plant.tyre=custom")),
            ("plant.tyre_e=-1", (change, ""), (change, "plant.tyre=custom")),
            ("plant.h_cg=0.8", (change, ""), (change, "plant.load_transfer=true")),
            ("plant.drive_front=0", (change, ""), (change, "plant.combined_slip=true")),
            ("plant.brake_front=0", (change, ""), (change, "plant.combined_slip=true plant.v_x_0=20")),
            ("plant.c_s=2", (change, "plant.crosswind=false"), (change, "")),
            ("plant.area_side=2", (change, "plant.crosswind=false"), (change, "")),
            ("plant.arm_side=1", (change, "plant.crosswind=false"), (change, "")),
            ("plant.gust_start=1", (change, ""), (change, "plant.gust_speed=10")),
            ("plant.gust_rise=1", (change, ""), (change, "plant.gust_speed=10")),
            ("plant.gust_hold=2", (change, ""), (change, "plant.gust_speed=10")),
            ("plant.gust_direction=0", (change, ""), (change, "plant.gust_speed=10")),
            ("plant.patch_start=30", (change, ""), (change, "plant.patch_length=20")),
            ("plant.patch_edge=9", (change, ""), (change, "plant.patch_length=20")),
            ("plant.patch_mu=0.6", (change, ""), (change, "plant.patch_length=20")),
            ("plant.seed=7", (change, ""), (change, "plant.noise_scale=1")),
            ("plant.laps=2", (change, ""), ("circuit", "")),
            ("plant.radius=30", (change, ""), ("constant_radius", "")),
            ("plant.steer_amplitude=0.1", (change, ""), ("step_steer", "")),
            ("plant.speed=9", ("circuit", ""), (change, "")),
            ("plant.road_tolerance=0", (change, ""), (points, "")),
            ("plant.width=1.5", (change, ""), ("iso_3888_1", "")),
            ("plant.overhang_f=5", (change, ""), ("iso_3888_2", "")),
            ("plant.overhang_r=5", (change, ""), ("iso_3888_2", "")),
            ("controller.network_file=", (change, "controller.adaptation=constant"), (change, "")),
            ("controller.sensor_noise=9", (change, "controller.estimation=measured"), (change, "")),
            ("controller.v_y_measured=false", (change, "controller.estimation=measured"), (change, "")),
        ];
        for (assignment, idle, acting) in idle_and_acting {
            let name = assignment.split_once('=').unwrap().0;
            for ((road, condition), acts) in [(idle, false), (acting, true)] {
                let given: Vec<&str> = condition.split_whitespace().collect();
                let set = [&given[..], &[assignment]].concat();
                let is_said = said(road, &set).iter().any(|remark| remark.contains(name));
                assert_eq!(is_said, !acts, "{assignment} on {road} with {condition}");
                if name != "controller.network_file" {
                    let changes = shown(road, &given) != shown(road, &set);
                    assert_eq!(changes, acts, "{assignment} on {road} with {condition}");
                }
            }
        }
        let tried: Vec<&str> = idle_and_acting.iter().map(|(text, ..)| text.split_once('=').unwrap().0).collect();
        let known: Vec<&str> = DEPENDENT.iter().flat_map(|dependent| dependent.names).copied().collect();
        assert_eq!(tried, known, "every dependency is tried");
    }

    #[test]
    fn a_remark_names_the_parameters_and_what_they_want() {
        assert_eq!(
            said("general", &["plant.tyre_b_f=9", "plant.tyre_c=1.3", "plant.speed=14", "plant.m=1600"]),
            [
                "Without effect: plant.tyre_b_f, plant.tyre_c, unless plant.tyre is custom.",
                "Without effect: plant.speed, unless the road has no speed of its own, as general, circuit and files have."
            ]
        );
        assert_eq!(
            said("general", &["controller.l_f=1.5"]),
            ["Without effect: controller.adaptation. The network is not of this car, the stiffnesses stay nominal: \
                 l_f was 1.2, it is 1.5 here. cargo fmu train --set makes one that is."]
        );
    }
}
