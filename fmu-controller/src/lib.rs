//! The adaptive LPV-MPC as an FMI 2.0 co-simulation unit: the variable table and the call into `lpv-mpc`.

mod variables;

use std::time::Instant;

use lpv_mpc::{Controller, Inputs, Parameters, Status};
use model_description::{Category, Experiment, Info, Log, Model, Outcome, Step, Table};
use serde::{Deserialize, Serialize};

/// The controller with everything that its importer may set.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct LpvMpcController {
    parameters: Parameters,
    inputs: Inputs,
    controller: Controller,
    /// Wall clock of the last step in which a sample was taken [s].
    solve_time: f64,
}

impl Default for LpvMpcController {
    fn default() -> Self {
        let parameters = Parameters::default();
        Self {
            controller: Controller::new(parameters.clone(), 0.0).expect("a test shows that the defaults are valid"),
            parameters,
            inputs: Inputs::default(),
            solve_time: 0.0,
        }
    }
}

impl Model for LpvMpcController {
    const INFO: Info = Info {
        name: "LpvMpcController",
        identifier: "lpv_mpc_controller",
        description: "Adaptive LPV model predictive control of a road vehicle's steering and speed",
        version: env!("CARGO_PKG_VERSION"),
        step_size: 0.001,
        stop_time: 15.0,
        max_step: 10.0,
        max_input_derivative_order: 0,
        max_output_derivative_order: 0,
        directional_derivative: false,
    };

    type Error = lpv_mpc::Error;

    fn table() -> &'static Table<Self> {
        variables::table()
    }

    fn initialize(&mut self, experiment: &Experiment<'_>, _log: &mut dyn Log) -> Result<(), Self::Error> {
        self.controller = Controller::new(self.parameters.clone(), experiment.start)?;
        Ok(())
    }

    fn tune(&mut self, _log: &mut dyn Log) -> Result<(), Self::Error> {
        self.controller.tune(&self.parameters)
    }

    fn step(&mut self, step: &Step<'_>, log: &mut dyn Log) -> Result<Outcome, Self::Error> {
        let samples = self.controller.samples();
        let before = Instant::now();
        self.controller.advance(step.t, step.h, &self.inputs)?;
        if self.controller.samples() == samples {
            return Ok(Outcome::Ok);
        }
        self.solve_time = before.elapsed().as_secs_f64();
        let status = self.controller.output().status;
        if log.enabled(Category::Event) {
            log.log(Category::Event, &format!("sample at {} s: {status}", step.t));
        }
        match status {
            Status::Optimal | Status::InteriorPoint => Ok(Outcome::Ok),
            Status::Estimated | Status::PreviousPlan | Status::SafeStop => {
                let Inputs { v_x, v_y, yaw_rate, e_y, e_psi, .. } = &self.inputs;
                Ok(Outcome::Degraded(format!(
                    "{status} at {} s (v_x {v_x}, v_y {v_y}, yaw_rate {yaw_rate}, e_y {e_y}, e_psi {e_psi})",
                    step.t
                )))
            }
        }
    }
}

model_description::export_fmu!(LpvMpcController);

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn committed_description_is_current() {
        model_description::assert_xml_current::<LpvMpcController>("../modelDescription/controller.xml");
    }
}
