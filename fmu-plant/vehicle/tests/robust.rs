//! Random parameters and inputs inside the declared ranges, roads from random text, and places far from the path.

mod driver;

use proptest::prelude::*;
use rand::{RngExt, SeedableRng, rngs::SmallRng};
use vehicle::{Error, Inputs, Parameters, Road, Vehicle, dynamics, road, tyre::Preset};

/// A random value between both ends, often one of them.
fn between(random: &mut SmallRng, min: f64, max: f64) -> f64 {
    match random.random_range(0..8_u32) {
        0 => min,
        1 => max,
        _ => min + (max - min) * random.random::<f64>(),
    }
}

macro_rules! draw {
    ($random:expr, $($field:ident),*) => {
        Parameters { $($field: between($random, Parameters::MIN.$field, Parameters::MAX.$field)),*, ..Parameters::default() }
    };
}

fn parameters(random: &mut SmallRng) -> Parameters {
    let mut p = draw!(
        random,
        m,
        l_f,
        l_r,
        g,
        mu,
        tyre_b_f,
        tyre_b_r,
        tyre_c,
        tyre_e,
        relaxation_length,
        h_cg,
        drive_front,
        brake_front,
        width,
        overhang_f,
        overhang_r,
        c_d,
        area,
        rho,
        c_s,
        area_side,
        arm_side,
        c_rr,
        delay_delta,
        tau_delta,
        delta_rate_max,
        delta_max,
        delay_a_x,
        tau_a_x,
        a_x_rate_max,
        a_x_min,
        a_x_max,
        grade,
        bank,
        patch_start,
        patch_length,
        patch_edge,
        patch_mu,
        gust_start,
        gust_rise,
        gust_hold,
        gust_speed,
        gust_direction,
        steer_amplitude,
        noise_scale,
        preview_step,
        e_y_0,
        e_psi_0,
        v_x_0
    );
    p.i_z = (p.m * p.l_f * p.l_r * between(random, 0.11, 9.9)).clamp(Parameters::MIN.i_z, Parameters::MAX.i_z);
    p.seed = random.random();
    p.tyre = Preset::ALL[random.random_range(0..Preset::ALL.len())].1;
    (p.load_transfer, p.combined_slip, p.crosswind) = (random.random(), random.random(), random.random());
    p
}

fn inputs(random: &mut SmallRng) -> Inputs {
    let mut draw = |pick: fn(&Inputs) -> f64| between(random, pick(&Inputs::MIN), pick(&Inputs::MAX));
    Inputs {
        delta: draw(|i| i.delta),
        a_x: draw(|i| i.a_x),
        wind_speed: draw(|i| i.wind_speed),
        wind_direction: draw(|i| i.wind_direction),
        mu_scale: draw(|i| i.mu_scale),
    }
}

/// All that the vehicle shows is finite.
fn assert_finite(vehicle: &Vehicle, inputs: &Inputs, case: &str) {
    let o = vehicle.outputs_under(inputs);
    let m = vehicle.measurement();
    let shown = [m.v_x, m.v_y, m.yaw_rate, m.e_y, m.e_psi, o.a_lat, o.a_long, o.alpha_f, o.alpha_r, o.f_yf, o.f_yr];
    let more = [o.c_f_true, o.c_r_true, o.delta_actual, o.a_x_actual, o.grip_usage, o.wind_speed_actual, o.x, o.y];
    let finite = shown.iter().chain(&more).all(|value| value.is_finite());
    assert!(finite, "{case}: {o:?} {m:?}\n{:?}\n{inputs:?}", vehicle.parameters());
    let seed = Inputs { delta: 1.0, a_x: 1.0, wind_speed: 1.0, wind_direction: 1.0, mu_scale: 1.0 };
    for (name, d) in [("inputs", vehicle.outputs_along(inputs, &seed)), ("time", vehicle.outputs_rate(inputs))] {
        let derivatives = [d.v_x_true, d.v_y_true, d.yaw_rate_true, d.s, d.a_lat, d.a_long, d.alpha_f, d.alpha_r];
        let more = [d.f_yf, d.f_yr, d.c_f_true, d.c_r_true, d.grip_usage, d.wind_speed_actual, d.a_x_actual];
        let finite = derivatives.iter().chain(&more).all(|value| value.is_finite());
        assert!(finite, "{case}: derivative by {name} {d:?}\n{:?}\n{inputs:?}", vehicle.parameters());
    }
    let preview = vehicle.preview();
    assert!(preview.kappa_ref.iter().chain(&preview.v_x_ref).all(|value| value.is_finite()), "{case}");
}

#[test]
fn a_hundred_thousand_random_vehicles_stay_finite() {
    let mut random = SmallRng::seed_from_u64(20_261_122);
    let roads: Vec<Road> = road::NAMES.iter().map(|name| Road::named(name, &Parameters::default()).unwrap()).collect();
    for draw in 0..100_000 {
        let parameters = parameters(&mut random);
        let relaxation = parameters.relaxation_length;
        let road = roads[random.random_range(0..roads.len())].clone();
        let mut vehicle = match Vehicle::new(parameters, road) {
            Ok(vehicle) => vehicle,
            Err(Error::Parameter { name: "relaxation_length", .. }) if relaxation < 0.05 => continue,
            Err(error) => panic!("draw {draw}: {error}"),
        };
        for _ in 0..2 {
            let inputs = inputs(&mut random);
            let h = [1e-4, 1e-3, 0.01, 0.033][random.random_range(0..4)];
            vehicle
                .advance(h, &inputs)
                .unwrap_or_else(|error| panic!("draw {draw}: {error}\n{:?}", vehicle.parameters()));
            assert_finite(&vehicle, &inputs, &format!("draw {draw}"));
        }
    }
}

#[test]
fn random_vehicles_survive_a_minute() {
    let mut random = SmallRng::seed_from_u64(7);
    for draw in 0..200 {
        let parameters = Parameters { relaxation_length: 0.0, ..parameters(&mut random) };
        let name = road::NAMES[random.random_range(0..road::NAMES.len())];
        let mut vehicle = driver::vehicle(name, parameters);
        for _ in 0..200 {
            let inputs = inputs(&mut random);
            vehicle
                .advance(0.3, &inputs)
                .unwrap_or_else(|error| panic!("draw {draw}: {error}\n{:?}", vehicle.parameters()));
            assert_finite(&vehicle, &inputs, &format!("draw {draw}"));
        }
    }
}

#[test]
fn values_outside_their_ranges_are_refused_by_name() {
    let mut vehicle = driver::vehicle("straight", Parameters::default());
    let before = vehicle.truth().clone();
    for (inputs, message) in [
        (Inputs { delta: f64::NAN, ..Inputs::default() }, "input delta = NaN lies outside its range -10 to 10"),
        (Inputs { mu_scale: -0.1, ..Inputs::default() }, "input mu_scale = -0.1 lies outside its range 0 to 2"),
    ] {
        assert_eq!(vehicle.advance(0.01, &inputs).unwrap_err().to_string(), message);
    }
    for h in [0.0, -1.0, f64::NAN, f64::INFINITY, 1e300] {
        assert!(matches!(vehicle.advance(h, &Inputs::default()), Err(Error::Step(_))), "step {h}");
    }
    assert_eq!(*vehicle.truth(), before, "a refused step moved the vehicle");
    let parameters = Parameters { i_z: 10.0, ..Parameters::default() };
    let road = Road::named("straight", &parameters).unwrap();
    let message = Vehicle::new(parameters, road).unwrap_err().to_string();
    assert!(message.starts_with("parameter i_z = 10 lies outside its range 302.4"), "{message}");
}

#[test]
fn inputs_that_change_stop_at_the_ends_of_their_ranges() {
    let start = Inputs { mu_scale: 0.7, ..Inputs::default() };
    let case = |rate: f64, pick: fn(&mut Inputs) -> &mut f64| {
        let mut rates = Inputs::ZERO;
        *pick(&mut rates) = rate;
        let [mut min, mut max] = [Inputs::MIN, Inputs::MAX];
        let mut want = start;
        *pick(&mut want) = if rate > 0.0 { *pick(&mut max) } else { *pick(&mut min) };
        for h in [1e-4, 0.1, 1.0] {
            for actuator in
                [Parameters::default(), Parameters { delay_delta: 0.2, tau_a_x: 0.1, ..Parameters::default() }]
            {
                let mut vehicle = driver::vehicle("straight", Parameters { v_x_0: 10.0, ..actuator });
                vehicle
                    .advance_along(h, &start, &rates)
                    .unwrap_or_else(|error| panic!("{rates:?} over {h} s: {error}"));
                let got = vehicle.truth().inputs;
                assert_eq!(got, want, "{rates:?} over {h} s");
                assert_finite(&vehicle, &got, &format!("{rates:?} over {h} s"));
                let o = vehicle.outputs();
                assert!(o.delta_actual.abs() <= vehicle.parameters().delta_max, "{} rad", o.delta_actual);
                vehicle.advance(0.1, &start).unwrap();
            }
        }
    };
    for rate in [1e7, 1e100, f64::MAX] {
        for pick in [
            (|i| &mut i.delta) as fn(&mut Inputs) -> &mut f64,
            |i| &mut i.a_x,
            |i| &mut i.wind_speed,
            |i| &mut i.wind_direction,
            |i| &mut i.mu_scale,
        ] {
            case(rate, pick);
            case(-rate, pick);
        }
    }
}

#[test]
fn any_negative_speed_at_the_start_means_that_of_the_road() {
    let of = |v_x_0| driver::vehicle("general", Parameters { v_x_0, ..Parameters::default() }).measurement().v_x;
    assert_eq!([of(-70.0), of(-5.0), of(-0.1)], [of(-1.0); 3]);
}

#[test]
fn projection_is_right_far_inside_a_hairpin() {
    // A hairpin of 12 m radius; the car leaves the road straight through the centre of the curve and beyond.
    let radius = 12.0;
    let mut table = "s,kappa,v_x\n0,0,10\n49,0,10\n".to_owned();
    let end = 51.0 + std::f64::consts::PI * radius;
    table.push_str(&format!("51,{k},10\n{end},{k},10\n{},0,10\n{},0,10\n", end + 2.0, end + 60.0, k = 1.0 / radius));
    let road = Road::from_csv(&table).unwrap();
    for heading in [0.3, 0.9, 1.5] {
        let parameters = Parameters { e_psi_0: heading, v_x_0: 15.0, ..Parameters::default() };
        let mut vehicle = Vehicle::new(parameters, road.clone()).unwrap();
        // Up to the curve on the road, then off at an angle.
        for _ in 0..600 {
            vehicle.advance(0.01, &Inputs::default()).unwrap();
            let o = vehicle.outputs();
            let pose = road.pose(o.s);
            let (x, y) = (pose.x - o.e_y_true * pose.psi.sin(), pose.y + o.e_y_true * pose.psi.cos());
            let case = format!("heading {heading}, ({}, {}), s {}", o.x, o.y, o.s);
            // Path coordinates always describe the place where the car is.
            assert!((x - o.x).hypot(y - o.y) < 1e-4, "{case}: ({x}, {y})");
            let turn = (o.psi - pose.psi - o.e_psi_true) / std::f64::consts::TAU;
            assert!((turn - turn.round()).abs() < 1e-5, "{case}: heading {}", o.e_psi_true);
            // And no place of the path nearby is nearer.
            let nearest = (-200..=200)
                .map(|i| road.pose(o.s + f64::from(i) * 0.05))
                .map(|p| (p.x - o.x).hypot(p.y - o.y))
                .fold(f64::INFINITY, f64::min);
            assert!(o.e_y_true.abs() < nearest + 1e-3, "{case}: {} but {nearest} is nearer", o.e_y_true);
        }
        assert!(vehicle.truth().x[dynamics::E_Y].abs() > 5.0);
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(300))]

    #[test]
    fn any_text_is_a_road_or_an_error(text in "[sxykappv_,0-9eE.\\-+\n ]{0,200}") {
        let _ = Road::from_csv(&text);
    }

    #[test]
    fn any_points_are_a_road_or_an_error(points in prop::collection::vec((-100.0..100.0_f64, -100.0..100.0_f64), 2..30), close: bool) {
        let mut text = "x,y,v_x\n".to_owned();
        for (x, y) in points.iter().chain(points.first().filter(|_| close)) {
            text.push_str(&format!("{x},{y},5\n"));
        }
        if let Ok(road) = Road::from_csv(&text) {
            prop_assert!(road.length().is_finite() && road.length() > 0.0);
            prop_assert!(road.curvature(0.5 * road.length()).abs() < 1.0);
        }
    }
}
