//! Bends that are sharper than a car can drive: no speed helps where the steering ends, and the car stands before them.

use anyhow::{Result, bail};
use vehicle::{Road, Vehicle};

/// Angle that a bend may turn beyond the steering [rad]. Of 21 bends of 29 to 180 deg with radii of 1.4 to 5 m the default
/// controller got through those of up to 0.14; with a wide `e_y_max` and eager steering as well, nothing from 0.49 on was driven.
const TURN_MAX: f64 = 0.5;
/// Distance of the places that are looked at [m]: the grid of road files.
const STEP: f64 = 0.1;

/// The bends of a road that a car cannot follow, by the worst of them.
#[derive(Clone, Copy, Debug)]
pub struct Bends {
    /// How many.
    count: usize,
    /// Smallest radius that the car can drive [m].
    smallest: f64,
    worst: Bend,
}

/// A stretch of road that is sharper than the car.
#[derive(Clone, Copy, Debug, Default)]
struct Bend {
    /// Where it is sharpest [m].
    place: f64,
    /// Curvature there [1/m].
    kappa: f64,
    /// Angle by which it turns more than the car at full lock does on the same way [rad].
    turn: f64,
}

/// Smallest radius that the centre of gravity can follow when tyres do not slip [m]; steering ends at `delta_max` [rad].
fn smallest(p: &vehicle::Parameters, delta_max: f64) -> f64 {
    ((p.l_f + p.l_r) / delta_max.tan()).hypot(p.l_r)
}

impl Bends {
    /// Those of the plant's road, as it is driven; none if the car can follow all of it. The steering ends at the plant's
    /// `delta_max` or at the controller's, given here [rad].
    pub fn of(plant: &Vehicle, delta_max: f64) -> Option<Self> {
        let p = plant.parameters();
        let smallest = smallest(p, p.delta_max.min(delta_max));
        let bends = sharper(plant.road(), 1.0 / smallest);
        let worst = bends.iter().max_by(|a, b| a.turn.total_cmp(&b.turn))?;
        Some(Self { count: bends.len(), smallest, worst: *worst })
    }

    /// Refuses what certainly cannot be driven to its end.
    pub fn possible(&self) -> Result<()> {
        if self.worst.turn > TURN_MAX {
            bail!(
                "{self}, and turns {:.0} deg more than the car can on the way through it: it would stand there. Give the road \
                 wider bends (a line through points gets smoother with plant.road_tolerance) or plant and controller a larger \
                 delta_max, or say by --stop how long to drive",
                self.worst.turn.to_degrees()
            );
        }
        Ok(())
    }
}

impl std::fmt::Display for Bends {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let Self { count, smallest, worst: Bend { place, kappa, .. } } = self;
        let others = if *count > 1 { format!(", the worst of {count},") } else { String::new() };
        let radius = 1.0 / kappa;
        write!(
            f,
            "the bend at {place:.1} m{others} has a radius of {radius:.2} m where the car's smallest is {smallest:.2} m by its \
             delta_max"
        )
    }
}

/// Stretches of a road with more than a curvature `kappa_max` [1/m].
fn sharper(road: &Road, kappa_max: f64) -> Vec<Bend> {
    let mut bends = Vec::new();
    let mut bend = Bend::default();
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "roads end at 100 km")]
    let cells = (road.length() / STEP).ceil() as u32;
    for cell in 0..=cells {
        let s = (f64::from(cell) * STEP).min(road.length());
        let kappa = road.curvature(s).abs();
        if kappa > kappa_max {
            bend.turn += (kappa - kappa_max) * STEP;
            if kappa > bend.kappa {
                (bend.place, bend.kappa) = (s, kappa);
            }
        }
        if bend.kappa > 0.0 && (kappa <= kappa_max || cell == cells) {
            bends.push(std::mem::take(&mut bend));
        }
    }
    bends
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::simulate::build;
    use crate::simulate::settings::Settings;

    /// Bends of a radius [m], 50 m apart and `length` [m] long besides their clothoids of 2 m.
    fn bends(radii: &[f64], length: f64, assignments: &[&str]) -> Option<Bends> {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("bends.csv");
        let kappa = |s: f64| -> f64 {
            let trapezoid = |start: f64| ((s - start).min(start + 4.0 + length - s) / 2.0).clamp(0.0, 1.0);
            (1_u32..).zip(radii).map(|(i, radius)| trapezoid(50.0 * f64::from(i)) / radius).sum()
        };
        // Close rows: between far ones the parabola overshoots.
        let rows = (0_u32..600).map(|i| 0.5 * f64::from(i)).map(|s| format!("{s},{},3\n", kappa(s)));
        std::fs::write(&file, "s,kappa,v_x\n".to_owned() + &rows.collect::<String>()).unwrap();
        let assignments: Vec<String> = assignments.iter().map(|&text| text.to_owned()).collect();
        let settings = Settings::new(file.to_str().unwrap(), &assignments).unwrap();
        let (plant, _) = build(&settings).unwrap();
        Bends::of(&plant, settings.controller.delta_max)
    }

    #[test]
    fn the_smallest_radius_is_that_of_the_default_car() {
        // Wheelbase 2.8 m, 30 deg: the rear axle's circle has a radius of 4.85 m, the centre of gravity is 1.6 m ahead of it.
        let p = vehicle::Parameters::default();
        assert!((smallest(&p, p.delta_max) - 5.107).abs() < 1e-3, "{}", smallest(&p, p.delta_max));
    }

    #[test]
    fn a_bend_that_cannot_be_driven_is_refused_with_place_and_radii() {
        let found = bends(&[20.0, 1.4, 3.0], 3.0, &[]).unwrap();
        let said = found.possible().unwrap_err().to_string();
        let radii = " m, the worst of 2, has a radius of 1.3";
        assert!(said.starts_with("the bend at 10") && said.contains(radii), "{said}");
        assert!(said.contains("smallest is 5.11 m by its delta_max, and turns 13"), "{said}");
        // Either side's bound ends the steering.
        for side in ["plant.delta_max=0.2", "controller.delta_max=0.2"] {
            let said = bends(&[8.0], 12.0, &[side]).unwrap().possible().unwrap_err().to_string();
            assert!(said.contains("smallest is 13.9"), "{said}");
        }
    }

    #[test]
    fn a_bend_that_is_grazed_is_mentioned_and_a_wider_one_is_not() {
        let found = bends(&[4.5], 3.0, &[]).unwrap();
        found.possible().unwrap();
        assert!(found.to_string().starts_with("the bend at 5"), "{found}");
        assert!(bends(&[5.5], 20.0, &[]).is_none());
        for name in vehicle::road::NAMES {
            let (plant, controller) = build(&Settings::new(name, &[]).unwrap()).unwrap();
            assert!(Bends::of(&plant, controller.parameters().delta_max).is_none(), "{name}");
        }
    }

    #[test]
    fn the_smoothed_line_counts_and_not_the_points() {
        // A circle of 10 m with noise of 1 cm each 40 cm: interpolation bends by up to 4 * 0.01 / 0.4^2 = 0.25 1/m more.
        let points: String = (0_u32..150)
            .map(|i| {
                let angle = f64::from(i) * 0.04;
                let r = 10.0 + 0.01 * (f64::from(i) * 2.4).sin();
                format!("{},{},3\n", r * angle.sin(), 10.0 - r * angle.cos())
            })
            .collect();
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("circle.csv");
        std::fs::write(&file, "x,y,v_x\n".to_owned() + &points).unwrap();
        let bends = |tolerance: &str| {
            let assignments = [format!("plant.road_tolerance={tolerance}")];
            let (plant, _) = build(&Settings::new(file.to_str().unwrap(), &assignments).unwrap()).unwrap();
            Bends::of(&plant, 1.0)
        };
        assert!(bends("0").is_some(), "through every point");
        assert!(bends("0.01").is_none());
    }
}
