use super::*;

const FREE: Actuator = Actuator { delay: 0.0, tau: 0.0, rate_max: 0.0, min: -10.0, max: 10.0 };

/// Moves an actuator through commands that each hold (or rise) for 0.05 s, and returns its course every 5 ms.
fn course(actuator: &Actuator, commands: &[Ramp]) -> Vec<f64> {
    let mut state = State::new(actuator);
    let mut points = Vec::new();
    for (i, command) in (0_u32..).zip(commands) {
        let start = 0.05 * f64::from(i);
        state.command(actuator, start, *command);
        for k in 0..10 {
            let mut done = 0.0;
            while done < 0.005 - 1e-12 {
                let since = 0.005 * f64::from(k) + done;
                let now = Ramp { value: command.value + command.slope * since, slope: command.slope };
                let (piece, length) = state.piece(actuator, start + since, now, 0.005 - done);
                state.position = piece.at(length);
                done += length;
            }
            points.push(state.position);
        }
    }
    points
}

/// The same by small steps of the differential equation.
fn stepped(actuator: &Actuator, commands: &[Ramp]) -> Vec<f64> {
    const STEPS: u32 = 20_000;
    let h = 0.05 / f64::from(STEPS);
    let at = |t: f64| {
        let sent = t - actuator.delay;
        if sent < 0.0 {
            return 0.0;
        }
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a few commands")]
        let i = ((sent / 0.05) as usize).min(commands.len() - 1);
        #[expect(clippy::cast_precision_loss, reason = "a few commands")]
        let since = sent - 0.05 * i as f64;
        (commands[i].value + commands[i].slope * since).clamp(actuator.min, actuator.max)
    };
    let mut position = 0.0;
    let mut points = Vec::new();
    for (i, _) in (0_u32..).zip(commands) {
        for k in 0..STEPS {
            let t = 0.05 * f64::from(i) + (f64::from(k) + 0.5) * h;
            let limit = if actuator.rate_max > 0.0 { actuator.rate_max } else { f64::INFINITY };
            let rate: f64 = if actuator.tau > 0.0 { (at(t) - position) / actuator.tau } else { (at(t) - position) / h };
            position += h * rate.clamp(-limit, limit);
            if (k + 1) % (STEPS / 10) == 0 {
                points.push(position);
            }
        }
    }
    points
}

#[test]
fn pieces_match_small_steps_of_the_differential_equation() {
    let hold = |value| Ramp { value, slope: 0.0 };
    let commands = [
        hold(0.3),
        Ramp { value: 0.3, slope: -4.0 },
        Ramp { value: 0.0, slope: 1.5 },
        Ramp { value: 0.2, slope: 12.0 },
        hold(-0.5),
        Ramp { value: -0.6, slope: -9.0 },
        hold(0.1),
        hold(0.1),
    ];
    for actuator in [
        Actuator { tau: 0.04, ..FREE },
        Actuator { rate_max: 3.0, ..FREE },
        Actuator { tau: 0.03, rate_max: 2.0, ..FREE },
        Actuator { tau: 0.03, rate_max: 2.0, delay: 0.02, ..FREE },
        Actuator { tau: 0.01, delay: 0.05, min: -0.4, max: 0.25, ..FREE },
    ] {
        let (got, want) = (course(&actuator, &commands), stepped(&actuator, &commands));
        for (i, (got, want)) in got.iter().zip(&want).enumerate() {
            // Euler's error: half the step of 2.5 us times rates of 50 1/s and 12 1/s.
            assert!((got - want).abs() < 1e-4, "{actuator:?}: {got} for {want} at {i}");
        }
    }
}

#[test]
fn without_dynamics_the_command_passes_at_once() {
    let state = State::new(&FREE);
    let (piece, length) = state.piece(&FREE, 0.0, Ramp { value: 0.7, slope: 0.0 }, 1.0);
    assert_eq!((piece.at(0.0), length), (0.7, 1.0));
    assert_eq!(FREE.gain(0.7), 1.0);
    assert_eq!(Actuator { delay: 0.1, ..FREE }.gain(0.7), 0.0);
}

#[test]
fn delay_shifts_the_command_exactly() {
    let actuator = Actuator { delay: 0.033, ..FREE };
    let commands: Vec<Ramp> = [1.0, -2.0, 3.0].map(|value| Ramp { value, slope: 0.0 }).to_vec();
    let got = course(&actuator, &commands);
    // Every 5 ms: the first command arrives after 33 ms, the second 50 ms later.
    let want: Vec<f64> = (1..=30)
        .map(|k| match f64::from(k) * 0.005 {
            t if t <= 0.033 => 0.0,
            t if t <= 0.083 => 1.0,
            t if t <= 0.133 => -2.0,
            _ => 3.0,
        })
        .collect();
    assert_eq!(got, want);
}

/// Largest difference of a delayed sine, commanded anew at every step `h`, to the sine of the time before, and the
/// largest number of changes that were kept.
fn delayed_sine(delay: f64, h: f64, ramps: bool) -> (f64, usize) {
    let actuator = Actuator { delay, ..FREE };
    let mut state = State::new(&actuator);
    let mut room = state.history.capacity();
    let (mut worst, mut entries): (f64, usize) = (0.0, 0);
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a count of steps")]
    for k in 0..(2.2 * delay / h) as u32 {
        let t = f64::from(k) * h;
        let slope = if ramps { OMEGA * (OMEGA * t).cos() } else { 0.0 };
        state.command(&actuator, t, Ramp { value: (OMEGA * t).sin(), slope });
        entries = entries.max(state.history.len());
        let (piece, _) = state.piece(&actuator, t, Ramp::default(), h);
        let want = if t < delay { 0.0 } else { (OMEGA * (t - delay)).sin() };
        worst = worst.max((piece.at(0.0) - want).abs());
        if k % 1000 == 0 {
            // Clones and what was written keep the room and the times.
            let bytes = postcard::to_allocvec(&state).unwrap();
            let mut read: State = postcard::from_bytes(&bytes).unwrap();
            read.make_room(&actuator);
            assert_eq!(read, state, "delay {delay} s, step {h} s");
            state = if k % 2000 == 0 { read } else { state.clone() };
            room = state.history.capacity();
        }
        assert_eq!(state.history.capacity(), room, "a step took memory: delay {delay} s, step {h} s");
    }
    (worst, entries)
}

/// Frequency of the sines [rad/s].
const OMEGA: f64 = 7.0;

#[test]
fn dense_commands_arrive_after_the_delay() {
    for delay in [0.05, 0.5, 1.0] {
        for h in [1e-5, 1e-4, 1e-3] {
            for ramps in [false, true] {
                let (worst, entries) = delayed_sine(delay, h, ramps);
                // A command that is held is up to a step old. Thinned, it is up to a part of the delay late on top of that.
                let late = h + if delay / h > 4000.0 { delay / f64::from(RESOLUTION) } else { 0.0 };
                let tolerance = OMEGA * late + 1e-9;
                assert!(worst < tolerance, "{worst} over {tolerance}: delay {delay} s, step {h} s, ramps {ramps}");
                assert!(entries <= CAPACITY, "{entries} entries: delay {delay} s, step {h} s");
            }
        }
    }
}

#[test]
fn thinning_leaves_room_however_the_commands_are_spread() {
    // Pairs of commands close to each other, and parts of the delay just below and above what is merged.
    let delay = 0.5;
    let part = delay / f64::from(RESOLUTION);
    for gaps in
        [[1e-3 * part, part], [0.501 * part, 0.501 * part], [0.499 * part, 0.499 * part], [1e-6 * part, 3.0 * part]]
    {
        let actuator = Actuator { delay, ..FREE };
        let mut state = State::new(&actuator);
        let mut t = 0.0;
        for k in 0..20_000_u32 {
            state.command(&actuator, t, Ramp { value: t, slope: 0.0 });
            t += gaps[k as usize % 2];
            assert!(state.history.len() <= CAPACITY, "{} entries, gaps {gaps:?}", state.history.len());
            let (piece, _) = state.piece(&actuator, t, Ramp::default(), 1.0);
            let late = (t - delay).max(0.0) - piece.at(0.0);
            assert!((-1e-9..=gaps[0] + gaps[1] + part).contains(&late), "{late} s late at {t} s, gaps {gaps:?}");
        }
    }
}
