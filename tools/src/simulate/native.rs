//! The closed loop on the cores, without FMI, in the order of a co-simulation master: both sides step over `[t, t + h]` with
//! what the other showed at `t`. So it gives the same bits as the packed FMUs, in a fraction of the time.

use anyhow::{Context, Result};
use lpv_mpc::Controller;
use vehicle::Vehicle;

use crate::recording::{Recording, Row};

/// Drives until `stop` [s], or until the road ends if `stop` is not given; `tick` is called after each step with the time [s].
pub fn drive(
    plant: &mut Vehicle,
    controller: &mut Controller,
    step: f64,
    stop: Option<f64>,
    mut tick: impl FnMut(f64),
) -> Result<Recording> {
    // A vehicle that never arrives must not run for ever: twice the reference's time is far more than tracking needs.
    let end = stop.unwrap_or_else(|| 2.0 * plant.road().duration());
    let mut recording = Recording { rows: vec![row(0.0, plant, controller)] };
    let mut steps = 0_u64;
    loop {
        // Times are multiples, not sums: a master that adds up steps drifts by rounding.
        let t = steps as f64 * step;
        if t + 0.5 * step > end || (stop.is_none() && plant.outputs().finished) {
            return Ok(recording);
        }
        let seen = seen(plant);
        let command = controller.output();
        let commands = vehicle::Inputs { delta: command.delta, a_x: command.a_x, ..vehicle::Inputs::default() };
        plant.advance(step, &commands).with_context(|| format!("the plant stopped at {t:.3} s"))?;
        controller.advance(t, step, &seen).with_context(|| format!("the controller stopped at {t:.3} s"))?;
        steps += 1;
        let t = steps as f64 * step;
        recording.rows.push(row(t, plant, controller));
        tick(t);
    }
}

/// What the controller is given: equal names are wired.
fn seen(plant: &Vehicle) -> lpv_mpc::Inputs {
    let measured = plant.measurement();
    let ahead = plant.preview();
    lpv_mpc::Inputs {
        v_x: measured.v_x,
        v_y: measured.v_y,
        yaw_rate: measured.yaw_rate,
        e_y: measured.e_y,
        e_psi: measured.e_psi,
        kappa_ref: ahead.kappa_ref,
        v_x_ref: ahead.v_x_ref,
        hold_preview: false,
    }
}

/// One sample, in the order of the recording's columns.
fn row(t: f64, plant: &Vehicle, controller: &Controller) -> Row {
    let o = plant.outputs();
    let ahead = plant.preview();
    let c = controller.output();
    [
        t,
        o.x,
        o.y,
        o.psi,
        o.s,
        o.v_x_true,
        o.v_y_true,
        o.yaw_rate_true,
        o.e_y_true,
        o.e_psi_true,
        ahead.v_x_ref[0],
        ahead.kappa_ref[0],
        o.a_lat,
        o.alpha_f,
        o.alpha_r,
        o.delta_actual,
        o.a_x_actual,
        o.grip_usage,
        o.wind_speed_actual,
        c.delta,
        c.a_x,
        c.c_f,
        c.c_r,
        f64::from(c.status as u8),
        f64::from(c.iterations),
        c.kkt_residual,
        c.slack_e_y,
    ]
}
