//! A model with a variable of every kind, and with every way to go wrong.

use model_description::{Enumeration, Experiment, Info, Item, Log, Model, Outcome, Step, Table, variables};
use serde::{Deserialize, Serialize};

/// What the model does in its next step.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub enum Trouble {
    #[default]
    None,
    Degrade,
    Fail,
    Panic,
}

impl From<i32> for Trouble {
    fn from(value: i32) -> Self {
        [Trouble::None, Trouble::Degrade, Trouble::Fail, Trouble::Panic][usize::try_from(value).unwrap()]
    }
}

const TROUBLE: Enumeration = Enumeration {
    name: "Trouble",
    description: "What the next step does",
    items: &[
        Item { value: 0, name: "none", description: "Works" },
        Item { value: 1, name: "degrade", description: "Falls back" },
        Item { value: 2, name: "fail", description: "Gives up" },
        Item { value: 3, name: "panic", description: "Panics" },
    ],
};

/// Integrates gain * u, with u extrapolated inside a step, and some bookkeeping.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Sample {
    pub u: f64,
    pub weights: [f64; 3],
    pub gain: f64,
    pub applied_gain: f64,
    pub trouble: Trouble,
    pub limit: usize,
    pub enabled: bool,
    pub label: String,
    pub y: f64,
    pub history: [f64; 4],
    pub count: i32,
    pub double_u: f64,
    pub refreshed: i32,
}

impl Default for Sample {
    fn default() -> Self {
        Self {
            u: 0.0,
            weights: [1.0, 2.0, 3.0],
            gain: 2.0,
            applied_gain: 0.0,
            trouble: Trouble::None,
            limit: 100,
            enabled: true,
            label: "ü & <b>".to_owned(),
            y: 0.0,
            history: [0.0; 4],
            count: 0,
            double_u: 0.0,
            refreshed: 0,
        }
    }
}

impl Model for Sample {
    const INFO: Info = Info {
        name: "Sample",
        identifier: "sample",
        description: "A variable of every kind",
        version: "1.0",
        max_step: 100.0,
        max_input_derivative_order: 1,
        max_output_derivative_order: 1,
        directional_derivative: true,
        ..Info::PLAIN
    };
    type Error = String;

    fn table() -> &'static Table<Self> {
        variables! { Sample;
            Input     u            ["m/s"]  "Input", terminal "drive", min -10.0, max 10.0 => u;
            Input     weights [3]  ["1"]    "Weights of the history", terminal "settings" => weights;
            Tunable   gain         ["1/s"]  "Gain", min 0.0, nominal 2.0 => gain;
            Parameter trouble               "What the next step does", items &TROUBLE
                => { get |m| m.trouble as i32, set |m, v: i32| m.trouble = Trouble::from(v) };
            Parameter limit                 "Largest number of steps", min 1.0, max 1000.0 => limit;
            Tunable   enabled               "Whether it integrates" => enabled;
            Parameter label                 "Any text" => label;
            Output    y            ["m"]    "Integral of gain * u", depends &[], lazy false => y;
            Output    history [4]  ["m"]    "The last values, newest first", depends &[], lazy false => |m, k| m.history[3 - k];
            Output    count                 "Number of steps", depends &[] => count;
            Output    double_u     ["m/s"]  "Twice the input", depends &["u"], terminal "echo" => double_u;
            Output    moving                "Whether there is input" => { get |m| m.u != 0.0 };
            Output    title                 "The label again", depends &[] => |m| m.label;
            Output    scaled [3]   ["rad"]  "Weights times the input" => { get |m, k| m.weights[k] * m.u };
            Local     refreshed             "Number of refreshes" => refreshed;
        }
    }

    fn initialize(&mut self, experiment: &Experiment<'_>, _: &mut dyn Log) -> Result<(), String> {
        if self.label == "bad" {
            return Err(format!("label {:?} is 100% bad", self.label));
        }
        self.y = experiment.start;
        self.history = [self.y; 4];
        self.applied_gain = self.gain;
        Ok(())
    }

    fn tune(&mut self, _: &mut dyn Log) -> Result<(), String> {
        self.applied_gain = self.gain;
        Ok(())
    }

    fn step(&mut self, step: &Step<'_>, _: &mut dyn Log) -> Result<Outcome, String> {
        match self.trouble {
            Trouble::Fail => return Err("cannot go on at 50% of %s".to_owned()),
            Trouble::Panic => panic!("boom at {} %", step.t),
            Trouble::None | Trouble::Degrade => {}
        }
        let u_dot = step.input_derivatives.iter().map(|derivative| derivative.value).sum::<f64>();
        if self.enabled {
            self.y += self.applied_gain * step.h * (self.u + 0.5 * u_dot * step.h);
        }
        self.count += 1;
        self.history.rotate_left(1);
        self.history[3] = self.y;
        Ok(if self.trouble == Trouble::Degrade {
            Outcome::Degraded("held the last value".to_owned())
        } else {
            Outcome::Ok
        })
    }

    fn refresh(&mut self) {
        self.double_u = 2.0 * self.u;
        self.refreshed += 1;
    }

    fn output_derivative(&self, reference: u32, _order: u32) -> Option<f64> {
        (Some(reference) == Self::table().find("y")).then_some(self.applied_gain * self.u)
    }

    fn directional_derivative(
        &self,
        unknowns: &[u32],
        knowns: &[u32],
        seed: &[f64],
        sensitivity: &mut [f64],
    ) -> Result<(), String> {
        let along_u: f64 = knowns.iter().zip(seed).filter(|(known, _)| **known == 0).map(|(_, seed)| seed).sum();
        for (unknown, sensitivity) in unknowns.iter().zip(sensitivity) {
            *sensitivity = if Some(*unknown) == Self::table().find("double_u") { 2.0 * along_u } else { 0.0 };
        }
        Ok(())
    }
}

model_description::export_fmu!(Sample);
