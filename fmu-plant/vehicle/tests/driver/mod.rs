//! A simple driver for the tests: curvature feed-forward with feedback of both errors, proportional speed.
#![allow(dead_code, reason = "no test file uses all of it")]

use vehicle::{Error, Inputs, Parameters, Road, Vehicle};

/// The paper's sample time [s].
pub const T_S: f64 = 0.033;

/// The command at the present state.
pub fn command(vehicle: &Vehicle) -> Inputs {
    let preview = vehicle.preview();
    let measured = vehicle.measurement();
    let p = vehicle.parameters();
    // Curvature 0.2 s ahead hides most of the tyres' and the sampling's lag.
    let kappa = preview.kappa_ref[6];
    // Steady-state steering of the linear bicycle with the default tyre; its understeer gradient is 0.0 within 1 %.
    let delta = kappa * (p.l_f + p.l_r) - 0.10 * measured.e_y - 0.6 * measured.e_psi;
    Inputs { delta, a_x: 2.0 * (preview.v_x_ref[0] - measured.v_x), ..Inputs::default() }
}

/// Drives for `samples` sample times with `substeps` communication steps in each; `each` sees the vehicle after each
/// sample.
pub fn drive(vehicle: &mut Vehicle, samples: u32, substeps: u32, mut each: impl FnMut(&Vehicle)) -> Result<(), Error> {
    for _ in 0..samples {
        let inputs = command(vehicle);
        for _ in 0..substeps {
            vehicle.advance(T_S / f64::from(substeps), &inputs)?;
        }
        each(vehicle);
    }
    Ok(())
}

/// A vehicle on a named road.
pub fn vehicle(road: &str, parameters: Parameters) -> Vehicle {
    let road = Road::named(road, &parameters).expect("the road is known");
    Vehicle::new(parameters, road).expect("the parameters are valid")
}
