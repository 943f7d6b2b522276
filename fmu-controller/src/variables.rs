//! Every variable of the controller, once.

use std::sync::OnceLock;

use lpv_mpc::parameters::HORIZON_MAX;
use lpv_mpc::preview::PREVIEW;
use lpv_mpc::{Adaptation, Backend, Estimation, Inputs, Status, TerminalCost};
use model_description::{Enumeration, Item, Scalar, Table, variables};

use crate::LpvMpcController;

const STATUS: Enumeration = Enumeration {
    name: "Status",
    description: "How good the present command is, in growing severity",
    items: &[
        Item { value: Status::Optimal as i32, name: "optimal", description: "The plan is optimal to rounding" },
        Item {
            value: Status::InteriorPoint as i32,
            name: "interior_point",
            description: "The plan is optimal to the tolerance of an interior point method",
        },
        Item {
            value: Status::SecondSolver as i32,
            name: "second_solver",
            description: "The plan is optimal to the tolerance of Clarabel: the chosen solver, or the structured one had no answer",
        },
        Item {
            value: Status::Estimated as i32,
            name: "estimated",
            description: "The plan is optimal, but a measurement was missing, not finite or not believed, and its estimate was used",
        },
        Item {
            value: Status::PreviousPlan as i32,
            name: "previous_plan",
            description: "No new plan, because of unusable inputs or a failed solve; the previous plan is executed further",
        },
        Item {
            value: Status::SafeStop as i32,
            name: "safe_stop",
            description: "Nothing of the previous plan is left: steering is held, the car brakes at its rate limit",
        },
    ],
};

const ADAPTATION: Enumeration = Enumeration {
    name: "Adaptation",
    description: "Where the cornering stiffnesses of the prediction model come from",
    items: &[
        Item {
            value: Adaptation::Constant as i32,
            name: "constant",
            description: "c_f_nominal and c_r_nominal, always",
        },
        Item {
            value: Adaptation::NetworkNow as i32,
            name: "network_now",
            description: "The network's answer at the measurement, held along the horizon",
        },
        Item {
            value: Adaptation::NetworkHorizon as i32,
            name: "network_horizon",
            description: "The network rolled along the previous plan, one stage at a time",
        },
    ],
};

const BACKEND: Enumeration = Enumeration {
    name: "Backend",
    description: "Which solver of the quadratic programme answers first",
    items: &[
        Item {
            value: Backend::Structured as i32,
            name: "structured",
            description: "Active set and interior point on the Riccati recursion",
        },
        Item {
            value: Backend::Clarabel as i32,
            name: "clarabel",
            description: "A general conic solver, slower by two orders of magnitude",
        },
    ],
};

const TERMINAL_COST: Enumeration = Enumeration {
    name: "TerminalCost",
    description: "What the state at the end of the horizon costs",
    items: &[
        Item {
            value: TerminalCost::StageWeights as i32,
            name: "stage_weights",
            description: "The weights of the stages, as in the paper",
        },
        Item {
            value: TerminalCost::Riccati as i32,
            name: "riccati",
            description: "What driving on without end costs, by the Riccati equation; for short horizons",
        },
    ],
};

const ESTIMATION: Enumeration = Enumeration {
    name: "Estimation",
    description: "Where the state that the plan starts from comes from",
    items: &[
        Item { value: Estimation::Measured as i32, name: "measured", description: "The measurement as it is" },
        Item {
            value: Estimation::Kalman as i32,
            name: "kalman",
            description: "A Kalman filter, which also estimates wind, grade and tyre mismatch as accelerations",
        },
    ],
};

/// First value reference behind the inputs that lead the table.
const LEADING: usize = 5 + 2 * PREVIEW;

/// The place of an input by its value reference; `None` for what is no input.
fn place(inputs: &mut Inputs, reference: u32) -> Option<&mut f64> {
    Some(match reference as usize {
        0 => &mut inputs.v_x,
        1 => &mut inputs.v_y,
        2 => &mut inputs.yaw_rate,
        3 => &mut inputs.e_y,
        4 => &mut inputs.e_psi,
        k if k < 5 + PREVIEW => &mut inputs.kappa_ref[k - 5],
        k if k < LEADING => &mut inputs.v_x_ref[k - 5 - PREVIEW],
        k => {
            static FIRST: OnceLock<Option<u32>> = OnceLock::new();
            let first = (*FIRST.get_or_init(|| table().find("mu_ref[1]")))? as usize;
            inputs.mu_ref.get_mut(k.checked_sub(first)?)?
        }
    })
}

/// A direction in the space of the inputs, given as pairs of value reference and component.
pub fn along(components: impl Iterator<Item = (u32, f64)>) -> Inputs {
    let mut direction = Inputs::default();
    for (reference, component) in components {
        if let Some(place) = place(&mut direction, reference) {
            *place += component;
        }
    }
    direction
}

/// Whether a value reference belongs to an input.
pub fn is_input(reference: u32) -> bool {
    place(&mut Inputs::default(), reference).is_some()
}

/// Name behind a value reference.
pub fn name(reference: u32) -> String {
    table().lookup(reference).map_or_else(|| reference.to_string(), |(row, element)| row.element_name(element))
}

/// Value of a Real variable; 0 for another type.
pub fn real(model: &LpvMpcController, reference: u32) -> f64 {
    match table().lookup(reference).map(|(row, element)| row.read(model, element)) {
        Some(Scalar::Real(value)) => value,
        _ => 0.0,
    }
}

/// Value references are rows: append, never reorder.
pub fn table() -> &'static Table<LpvMpcController> {
    variables! { LpvMpcController;
        Input v_x ["m/s"] "Longitudinal velocity, body frame", terminal "measurement" => inputs.v_x;
        Input v_y ["m/s"] "Lateral velocity of the centre of gravity, positive to the left", terminal "measurement" => inputs.v_y;
        Input yaw_rate ["rad/s"] "Yaw rate, positive to the left", terminal "measurement" => inputs.yaw_rate;
        Input e_y ["m"] "Lateral position relative to the path, positive to the left", terminal "measurement" => inputs.e_y;
        Input e_psi ["rad"] "Vehicle heading minus path heading", terminal "measurement" => inputs.e_psi;
        Input kappa_ref [PREVIEW] ["1/m"] "Curvature of the path now (element 1) and at the next 40 sample times, positive to the left", terminal "preview" => inputs.kappa_ref;
        Input v_x_ref [PREVIEW] ["m/s"] "Wanted speed now (element 1) and at the next 40 sample times", terminal "preview" => inputs.v_x_ref;

        Output delta ["rad"] "Front steering angle command", terminal "command" => { get |m| m.output.delta };
        Output a_x ["m/s2"] "Longitudinal acceleration command", terminal "command" => { get |m| m.output.a_x };
        Output c_f ["N/rad"] "Front cornering stiffness that the controller believes in" => { get |m| m.output.c_f };
        Output c_r ["N/rad"] "Rear cornering stiffness that the controller believes in" => { get |m| m.output.c_r };
        Output status "How good the present command is", items &STATUS => { get |m| m.output.status as i32 };
        Output iterations "Iterations of the solver in the last sample" => { get |m| m.output.iterations };
        Output kkt_residual ["1"] "Scaled residual of the conditions of optimality" => { get |m| m.output.kkt_residual };
        Output slack_e_y ["m"] "Largest predicted excess over e_y_max" => { get |m| m.output.slack_e_y };
        Output solve_time ["s"] "Wall clock of the last sample, the only value that is not reproducible" => { get |m| m.solve_time };
        Output e_y_pred [HORIZON_MAX] ["m"] "Predicted lateral error, one element per period; beyond the horizon the last value" => { get |m, k| m.output.e_y_pred[k] };
        Output e_psi_pred [HORIZON_MAX] ["rad"] "Predicted heading error" => { get |m, k| m.output.e_psi_pred[k] };
        Output v_x_pred [HORIZON_MAX] ["m/s"] "Predicted longitudinal velocity" => { get |m, k| m.output.v_x_pred[k] };
        Output v_y_pred [HORIZON_MAX] ["m/s"] "Predicted lateral velocity" => { get |m, k| m.output.v_y_pred[k] };
        Output yaw_rate_pred [HORIZON_MAX] ["rad/s"] "Predicted yaw rate" => { get |m, k| m.output.yaw_rate_pred[k] };
        Output delta_pred [HORIZON_MAX] ["rad"] "Planned steering angle commands" => { get |m, k| m.output.delta_pred[k] };
        Output a_x_pred [HORIZON_MAX] ["m/s2"] "Planned acceleration commands" => { get |m, k| m.output.a_x_pred[k] };

        Parameter m ["kg"] "Mass", min 1.0, max 1e5 => parameters.m;
        Parameter i_z ["kg m2"] "Yaw inertia", min 1.0, max 1e6 => parameters.i_z;
        Parameter l_f ["m"] "Distance from the centre of gravity to the front axle", min 0.01, max 20.0 => parameters.l_f;
        Parameter l_r ["m"] "Distance from the centre of gravity to the rear axle", min 0.01, max 20.0 => parameters.l_r;
        Parameter c_d ["1"] "Drag coefficient", min 0.0, max 5.0 => parameters.c_d;
        Parameter area ["m2"] "Frontal area", min 0.0, max 50.0 => parameters.area;
        Parameter rho ["kg/m3"] "Air density", min 0.0, max 5.0 => parameters.rho;
        Parameter c_rr ["1"] "Rolling resistance coefficient", min 0.0, max 1.0 => parameters.c_rr;
        Parameter g ["m/s2"] "Gravitational acceleration", min 0.1, max 100.0 => parameters.g;
        Parameter c_f_nominal ["N/rad"] "Nominal cornering stiffness of the front axle", min 100.0, max 1e7 => parameters.c_f_nominal;
        Parameter c_r_nominal ["N/rad"] "Nominal cornering stiffness of the rear axle", min 100.0, max 1e7 => parameters.c_r_nominal;
        Parameter t_s ["s"] "Controller period", min 1e-3, max 0.2 => parameters.t_s;
        Parameter horizon "Prediction horizon in periods; about 1 s is what the limit of grip needs", min 1.0, max 40.0 => parameters.horizon;
        Tunable q_v_x ["s2/m2"] "Weight on the speed error", min 0.0, max 1e12 => parameters.q_v_x;
        Tunable q_v_y ["s2/m2"] "Weight on the lateral velocity error", min 0.0, max 1e12 => parameters.q_v_y;
        Tunable q_yaw_rate ["s2/rad2"] "Weight on the yaw rate error", min 0.0, max 1e12 => parameters.q_yaw_rate;
        Tunable q_e_y ["1/m2"] "Weight on the lateral error", min 0.0, max 1e12 => parameters.q_e_y;
        Tunable q_e_psi ["1/rad2"] "Weight on the heading error", min 0.0, max 1e12 => parameters.q_e_psi;
        Tunable r_delta ["1/rad2"] "Weight on the steering increment per period", min 1e-12, max 1e12 => parameters.r_delta;
        Tunable r_a_x ["s4/m2"] "Weight on the acceleration increment per period", min 1e-12, max 1e12 => parameters.r_a_x;
        Tunable terminal_factor ["1"] "Factor of the terminal cost", min 0.0, max 1e6 => parameters.terminal_factor;
        Tunable delta_max ["rad"] "Largest steering angle", min 1e-3, max 1.5 => parameters.delta_max;
        Tunable delta_rate_max ["rad/s"] "Largest steering rate", min 1e-3, max 100.0 => parameters.delta_rate_max;
        Tunable a_x_min ["m/s2"] "Strongest braking, negative", min -50.0, max -0.01 => parameters.a_x_min;
        Tunable a_x_max ["m/s2"] "Strongest acceleration", min 0.01, max 50.0 => parameters.a_x_max;
        Tunable a_x_rate_max ["m/s3"] "Largest rate of the acceleration", min 0.01, max 1e4 => parameters.a_x_rate_max;
        Tunable e_y_max ["m"] "Lateral error beyond which the soft constraint costs", min 1e-3, max 100.0 => parameters.e_y_max;
        Tunable e_y_penalty ["1/m2"] "Penalty on the squared excess over e_y_max", min 0.0, max 1e12 => parameters.e_y_penalty;
        Parameter adaptation "Where the cornering stiffnesses of the prediction model come from", items &ADAPTATION
            => { get |m| m.parameters.adaptation as i32, set |m, v: i32| m.parameters.adaptation = adaptation(v) };
        Parameter backend "Which solver of the quadratic programme answers first", items &BACKEND
            => { get |m| m.parameters.backend as i32, set |m, v: i32| m.parameters.backend = backend(v) };
        Parameter input_delay ["s"] "Latency of the actuators beyond the communication step", min 0.0, max 1.0 => parameters.input_delay;
        Parameter tau_delta ["s"] "Time constant of the steering actuator; 0: none", min 0.0, max 10.0 => parameters.tau_delta;
        Parameter tau_a_x ["s"] "Time constant of the drive and brake actuator; 0: none", min 0.0, max 10.0 => parameters.tau_a_x;
        Parameter estimation "Where the state that the plan starts from comes from", items &ESTIMATION
            => { get |m| m.parameters.estimation as i32, set |m, v: i32| m.parameters.estimation = estimation(v) };
        Parameter sensor_noise ["1"] "Largest standard deviations of the sensors, in units of 0.03 m/s, 0.002 rad/s, 0.01 m and 0.002 rad", min 1e-3, max 1e3 => parameters.sensor_noise;
        Parameter v_y_measured "Whether the lateral velocity is measured; if not, it is estimated" => parameters.v_y_measured;
        Parameter hold_preview "Whether only element 1 of each preview is given and holds for the others" => inputs.hold_preview;
        Parameter network_file "File of the network's weights, a path or file URI, relative to the resources; empty: the built-in network" => network_file;
        Output confidence ["1"] "How far the network is believed: 0 the nominal stiffnesses, 1 the network's", min 0.0, max 1.0 => { get |m| m.output.confidence };
        Input mu_ref [PREVIEW] ["1"] "Friction of the road now (element 1) and where the reference will be at the next 40 sample times; 0: unknown, mu holds", terminal "preview", min 0.0, max 5.0 => inputs.mu_ref;
        Parameter terminal_cost "What the state at the end of the horizon costs, before terminal_factor", items &TERMINAL_COST
            => { get |m| m.parameters.terminal_cost as i32, set |m, v: i32| m.parameters.terminal_cost = terminal_cost(v) };
        Tunable mu ["1"] "Friction of the road where mu_ref does not tell it, and that at which c_f_nominal and c_r_nominal hold", min 0.01, max 5.0 => parameters.mu;
        Tunable grip_max ["1"] "Share of the grip that the planned speed may use; 0: the wanted speed is planned whatever it takes, and no way back from far off the path", min 0.0, max 2.0 => parameters.grip_max;
    }
}

/// The table lets only values of the enumeration through.
fn adaptation(value: i32) -> Adaptation {
    [Adaptation::NetworkNow, Adaptation::NetworkHorizon]
        .into_iter()
        .find(|mode| *mode as i32 == value)
        .unwrap_or(Adaptation::Constant)
}

/// The table lets only values of the enumeration through.
fn terminal_cost(value: i32) -> TerminalCost {
    if value == TerminalCost::Riccati as i32 { TerminalCost::Riccati } else { TerminalCost::StageWeights }
}

/// The table lets only values of the enumeration through.
fn backend(value: i32) -> Backend {
    if value == Backend::Clarabel as i32 { Backend::Clarabel } else { Backend::Structured }
}

/// The table lets only values of the enumeration through.
fn estimation(value: i32) -> Estimation {
    if value == Estimation::Kalman as i32 { Estimation::Kalman } else { Estimation::Measured }
}

#[cfg(test)]
mod tests {
    use model_description::Role;

    use super::*;

    #[test]
    fn directions_follow_the_table() {
        let inputs: Vec<u32> =
            table().variables().filter(|(.., row, _)| row.role == Role::Input).map(|(vr, ..)| vr).collect();
        assert_eq!(inputs.len(), 5 + 3 * PREVIEW);
        for seed in &inputs {
            let model = LpvMpcController { inputs: along([(*seed, 1.0)].into_iter()), ..LpvMpcController::default() };
            for reference in &inputs {
                assert!(is_input(*reference));
                assert_eq!(real(&model, *reference), f64::from(u8::from(reference == seed)), "{}", name(*seed));
            }
        }
        let others = table().variables().filter(|(.., row, _)| row.role != Role::Input);
        assert_eq!(others.filter(|(vr, ..)| is_input(*vr)).count(), 0);
    }
}
