use crate::Road;

fn circle(radius: f64, points: u32, noise: f64) -> String {
    let mut text = "x,y,v_x\n".to_owned();
    for i in 0..=points {
        let angle = std::f64::consts::TAU * f64::from(i % points) / f64::from(points);
        // A deterministic disturbance that looks like noise: irrational steps of a sine.
        let r = radius + noise * (f64::from(i % points) * 2.4).sin();
        text.push_str(&format!("{},{},10\n", 1e5 + r * angle.sin(), r * (1.0 - angle.cos()) + radius - r));
    }
    text
}

#[test]
fn table_of_a_parabola_is_reproduced() {
    let text: String = std::iter::once("s,kappa,v_x,mu\n".to_owned())
        .chain((0..20).map(|i| format!("{},{},{},0.5\n", i * 5, f64::from(i * i) * 1e-4, 10.0)))
        .collect();
    let road = Road::from_csv(&text).unwrap();
    // Inner slopes of a parabola are exact, so is the cubic.
    for s in [12.0, 43.7, 80.1] {
        let want = (s / 5.0_f64).powi(2) * 1e-4;
        assert!((road.curvature(s) - want).abs() < 1e-12, "{} for {want}", road.curvature(s));
        assert!((road.friction(s) - 0.5).abs() < 1e-12);
    }
    assert!((road.length() - 95.0).abs() < 1e-12);
}

#[test]
fn points_on_a_circle_give_its_curvature() {
    let radius = 40.0;
    let road = Road::from_csv(&circle(radius, 60, 0.0)).unwrap();
    assert!(road.is_closed());
    // The smoothing may shift the line by its tolerance of 1 cm.
    assert!((road.length() - std::f64::consts::TAU * radius).abs() < 0.1, "{} m", road.length());
    for i in 0..250 {
        let kappa = road.curvature(f64::from(i));
        assert!((kappa - 1.0 / radius).abs() < 2e-3 / radius, "{kappa} at {i} m");
    }
    assert!((road.start().x - 1e5).abs() < 0.02 && road.start().psi.abs() < 1e-2, "{:?}", road.start());
}

#[test]
fn noise_of_a_receiver_does_not_reach_the_curvature() {
    let radius = 60.0;
    let road = Road::from_csv(&circle(radius, 300, 0.012)).unwrap();
    // Interpolation would give curvatures of 8 * 0.012 / (1.26 m)^2 = 0.06 1/m from these points.
    for i in 0..370 {
        let kappa = road.curvature(f64::from(i));
        assert!((kappa - 1.0 / radius).abs() < 0.1 / radius, "{kappa} at {i} m");
    }
}

#[test]
fn points_of_the_lane_change_give_its_curvature_back() {
    let named = Road::named("double_lane_change", &crate::Parameters::default()).unwrap();
    let mut text = "# surveyed\nx, y, v_x\n".to_owned();
    for i in 0..=100 {
        let pose = named.pose(f64::from(i) * 2.0);
        text.push_str(&format!("{:.4}, {:.4}, 14\n", pose.x, pose.y));
    }
    let road = Road::from_csv_within(&text, 0.0).unwrap();
    assert!(!road.is_closed());
    for i in 5..195 {
        let (got, want) = (road.curvature(f64::from(i)), named.curvature(f64::from(i)));
        // The second derivative of a cubic spline errs by h^2 / 12 times the fourth: 4 / 12 * 0.027 (2 * 2.4 / 21.95)^2
        // = 4e-4 1/m, and points rounded to 0.1 mm add up to 4 * 5e-5 / h^2 = 5e-5.
        assert!((got - want).abs() < 5e-4, "{got} for {want} at {i} m");
    }
}

#[test]
fn a_header_is_understood_as_people_write_it() {
    let rows = "0,0.01,10\n50,0.02,12\n90,0,9\n";
    let plain = Road::from_csv(&format!("s,kappa,v_x\n{rows}")).unwrap();
    for header in ["s,curvature,speed", "S [m], Kappa [1/m], V_x [m/s]", "s[m],Curvature,Speed [m/s]"] {
        let road = Road::from_csv(&format!("{header}\n{rows}")).unwrap();
        assert_eq!((road.curvature(33.0), road.speed(70.0)), (plain.curvature(33.0), plain.speed(70.0)), "{header}");
    }
}

#[test]
fn bad_tables_are_refused_with_line_and_column() {
    for (text, message) in [
        ("", "road table: it is empty"),
        ("s,kappa,v_x\n", "road table: it has a header but no rows"),
        ("s,kappa,v_x\n0,0,10\n", "road table: one row is no road"),
        (
            "a,b\n1,2\n",
            "road table, line 1, column 1: unknown column \"a\": known are s, kappa, x, y, v_x, grade, bank, mu",
        ),
        ("s,s,v_x\n0,0,1\n", "road table, line 1, column 2: column \"s\" comes twice"),
        ("s;kappa;v_x\n0;0;1\n", "road table, line 1, column 1: commas are wanted between the fields, not semicolons"),
        ("s\tkappa\tv_x\n", "road table, line 1, column 1: commas are wanted between the fields, not tabs"),
        (
            "s,kappa,v_x\n0;0;10\n",
            "road table, line 2, column 2: 3 fields are wanted, 1 found: kappa is missing; commas are wanted between the fields, \
             not semicolons",
        ),
        (
            "0,0,10\n5,0,10\n",
            "road table, line 1, column 1: the header is missing: the first line names the columns, s,kappa,v_x or x,y,v_x",
        ),
        ("x,y,v_x [km/h]\n", "road table, line 1, column 3: \"v_x [km/h]\" has another unit than v_x is read in: m/s"),
        ("s,kappa,v_x,speed\n", "road table, line 1, column 4: column \"speed\" comes twice"),
        ("s,kappa,v_x,mu\n0,0,10,3\n", "road table, line 2, column 4: mu = 3 lies outside 0 to 2"),
        ("x,y\n0,0\n", "road table, line 1, column 1: the header must hold either s,kappa,v_x or x,y,v_x"),
        ("s,kappa,v_x\n0,0,10\n\n5,zero,10\n", "road table, line 4, column 2: \"zero\" is not a number"),
        ("s,kappa,v_x\n0,0,10\n5,0\n", "road table, line 3, column 3: 3 fields are wanted, 2 found: v_x is missing"),
        ("s,kappa,v_x\n0,0,10\n5,0,1,7\n", "road table, line 3, column 4: 3 fields are wanted, 4 found"),
        ("s,kappa,v_x\n0,0,10\n5,0,NaN\n", "road table, line 3, column 3: v_x = NaN lies outside 0 to 100 m/s"),
        ("s,kappa,v_x\n5,0,10\n5,0,10\n", "road table, line 3, column 1: arc length 5 does not exceed the 5 before it"),
        ("v_x,x,y\n9,0,0\n9,1,0\n9,1,0\n", "road table, line 4, column 2: (1, 0) repeats the point before it"),
        ("x,y,v_x\n0,0,9\n1,0,9\n2,0,9\n", "road table: 3 points are too few for a smooth line: at least 4 are needed"),
    ] {
        assert_eq!(Road::from_csv(text).unwrap_err().to_string(), message);
    }
}
