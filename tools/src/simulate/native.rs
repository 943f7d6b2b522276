//! The closed loop on the cores, without FMI, in the order of a co-simulation master: both sides step over `[t, t + h]` with
//! what the other showed at `t`. So it gives the same bits as the packed FMUs, in a fraction of the time.

use anyhow::{Context, Result};
use lpv_mpc::{Controller, Status};
use vehicle::Vehicle;

use super::journey;
use crate::recording::{Recording, Row};

/// What can drive the vehicle: it sees what the plant measures and answers with commands, one communication step at a time.
pub trait Driver {
    /// One step from time `t` [s] over `h` [s], with what was seen at `t`. Its command is visible afterwards.
    ///
    /// # Errors
    /// If the driver cannot go on.
    fn advance(&mut self, t: f64, h: f64, seen: &lpv_mpc::Inputs) -> Result<()>;

    /// What is visible now.
    fn shown(&self) -> Shown;
}

/// The part of a driver's output that is recorded.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Shown {
    /// Front steering angle command [rad].
    pub delta: f64,
    /// Longitudinal acceleration command [m/s2].
    pub a_x: f64,
    /// Front cornering stiffness that the driver believes in [N/rad].
    pub c_f: f64,
    /// Rear cornering stiffness that the driver believes in [N/rad].
    pub c_r: f64,
    /// How good the command is.
    pub status: Status,
    /// Iterations of a solver.
    pub iterations: u32,
    /// Scaled residual of the conditions of optimality [1].
    pub kkt_residual: f64,
    /// Largest predicted excess over the soft bound on the lateral error [m].
    pub slack_e_y: f64,
}

impl<D: Driver + ?Sized> Driver for Box<D> {
    fn advance(&mut self, t: f64, h: f64, seen: &lpv_mpc::Inputs) -> Result<()> {
        (**self).advance(t, h, seen)
    }

    fn shown(&self) -> Shown {
        (**self).shown()
    }
}

impl Driver for Controller {
    fn advance(&mut self, t: f64, h: f64, seen: &lpv_mpc::Inputs) -> Result<()> {
        Ok(Self::advance(self, t, h, seen)?)
    }

    fn shown(&self) -> Shown {
        let o = self.output();
        Shown {
            delta: o.delta,
            a_x: o.a_x,
            c_f: o.c_f,
            c_r: o.c_r,
            status: o.status,
            iterations: o.iterations,
            kkt_residual: o.kkt_residual,
            slack_e_y: o.slack_e_y,
        }
    }
}

/// Drives until `stop` [s], or until the road ends if `stop` is not given; `tick` is called after each step with the time [s].
pub fn drive(
    plant: &mut Vehicle,
    driver: &mut impl Driver,
    step: f64,
    stop: Option<f64>,
    tick: impl FnMut(f64),
) -> Result<Recording> {
    drive_through(plant, driver, step, stop, |_, _| {}, tick)
}

/// The same with something between the two: `alter` changes, at a time [s], what the driver is given.
pub fn drive_through(
    plant: &mut Vehicle,
    driver: &mut impl Driver,
    step: f64,
    stop: Option<f64>,
    mut alter: impl FnMut(f64, &mut lpv_mpc::Inputs),
    tick: impl FnMut(f64),
) -> Result<Recording> {
    drive_in(plant, driver, step, stop, |t, seen, _| alter(t, seen), tick)
}

/// The same in a world of its own: `world` changes, at a time [s], what the driver is given and what acts on the plant.
pub fn drive_in(
    plant: &mut Vehicle,
    driver: &mut impl Driver,
    step: f64,
    stop: Option<f64>,
    world: impl FnMut(f64, &mut lpv_mpc::Inputs, &mut vehicle::Inputs),
    mut tick: impl FnMut(f64),
) -> Result<Recording> {
    let watch = |t, _| {
        tick(t);
        true
    };
    drive_while(plant, driver, step, stop, world, watch)
}

/// The same as long as `watch` wants it, which is called after each step with the time [s] and the way along the road [m].
pub fn drive_while(
    plant: &mut Vehicle,
    driver: &mut impl Driver,
    step: f64,
    stop: Option<f64>,
    mut world: impl FnMut(f64, &mut lpv_mpc::Inputs, &mut vehicle::Inputs),
    mut watch: impl FnMut(f64, f64) -> bool,
) -> Result<Recording> {
    // A vehicle that never arrives must not run for ever: twice the reference's time is far more than tracking needs.
    let end = stop.unwrap_or_else(|| 2.0 * journey::time(plant));
    let mut recording = Recording { rows: vec![row(0.0, plant, driver)] };
    let mut steps = 0_u64;
    loop {
        // Times are multiples, not sums: a master that adds up steps drifts by rounding.
        let t = steps as f64 * step;
        if t + 0.5 * step > end || (stop.is_none() && plant.outputs().finished) {
            return Ok(recording);
        }
        let mut seen = seen(plant);
        let command = driver.shown();
        let mut acting = vehicle::Inputs { delta: command.delta, a_x: command.a_x, ..vehicle::Inputs::default() };
        world(t, &mut seen, &mut acting);
        plant.advance(step, &acting).with_context(|| format!("the plant stopped at {t:.3} s"))?;
        driver.advance(t, step, &seen).with_context(|| format!("the controller stopped at {t:.3} s"))?;
        steps += 1;
        let t = steps as f64 * step;
        recording.rows.push(row(t, plant, driver));
        if !watch(t, plant.outputs().s) {
            return Ok(recording);
        }
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
        mu_ref: ahead.mu_ref,
        hold_preview: false,
    }
}

/// One sample, in the order of the recording's columns.
fn row(t: f64, plant: &Vehicle, driver: &impl Driver) -> Row {
    let o = plant.outputs();
    let ahead = plant.preview();
    let c = driver.shown();
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
        o.c_f_true,
        o.c_r_true,
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
