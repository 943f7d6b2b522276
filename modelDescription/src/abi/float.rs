//! The floating-point mode. Importers may round otherwise, flush small numbers to zero or trap exceptions; Rust assumes that none of this
//! is so, and a run must give the same bits in every importer. So a call computes in the standard mode and leaves the importer's as it was.

/// Runs the body in the standard floating-point mode. The body must not unwind.
#[inline]
pub(super) fn in_standard_mode<T>(body: impl FnOnce() -> T) -> T {
    let importers = mode();
    if importers & CONTROL == STANDARD {
        return body();
    }
    set_mode(STANDARD);
    let result = body();
    set_mode(importers);
    result
}

#[cfg(target_arch = "x86_64")]
mod register {
    use std::arch::asm;

    /// Exceptions masked, round to nearest, denormals kept: MXCSR after power-up (Intel SDM, volume 1, section 10.2.3).
    pub const STANDARD: u32 = 0x1F80;
    /// All but the six flags that operations leave behind, which do no harm.
    pub const CONTROL: u32 = !0x3F;

    #[inline]
    pub fn mode() -> u32 {
        let mut value = 0_u32;
        // SAFETY: stores the register's 32 bits where it is told to.
        unsafe { asm!("stmxcsr [{}]", in(reg) &raw mut value, options(nostack, preserves_flags)) };
        value
    }

    #[inline]
    pub fn set_mode(value: u32) {
        // SAFETY: the value is STANDARD or was read from the register, so no reserved bit is set.
        unsafe { asm!("ldmxcsr [{}]", in(reg) &raw const value, options(nostack, preserves_flags)) };
    }
}

#[cfg(target_arch = "aarch64")]
mod register {
    use std::arch::asm;

    /// No traps, round to nearest, denormals kept: FPCR all zero (Arm ARM, section C5.2.8).
    pub const STANDARD: u64 = 0;
    /// Every bit controls.
    pub const CONTROL: u64 = !0;

    #[inline]
    pub fn mode() -> u64 {
        let value;
        // SAFETY: reads a register.
        unsafe { asm!("mrs {}, fpcr", out(reg) value, options(nomem, nostack, preserves_flags)) };
        value
    }

    #[inline]
    pub fn set_mode(value: u64) {
        // SAFETY: the value is STANDARD or was read from the register.
        unsafe { asm!("msr fpcr, {}", in(reg) value, options(nostack, preserves_flags)) };
    }
}

#[cfg(not(any(target_arch = "x86_64", target_arch = "aarch64")))]
mod register {
    /// Elsewhere the importer's mode is taken to be the standard one.
    pub const STANDARD: u32 = 0;
    pub const CONTROL: u32 = 0;

    pub fn mode() -> u32 {
        STANDARD
    }

    pub fn set_mode(_: u32) {}
}

use register::{CONTROL, STANDARD, mode, set_mode};

#[cfg(all(test, target_arch = "x86_64"))]
mod tests {
    use std::hint::black_box;

    use super::*;

    /// Round up, flush to zero, denormals are zero; exceptions stay masked.
    const ODD: u32 = STANDARD | 0x4000 | 0x8000 | 0x0040;

    #[test]
    fn the_importers_mode_neither_matters_nor_changes() {
        let compute = || black_box(1.0_f64) / black_box(3.0) + black_box(f64::MIN_POSITIVE) / black_box(4.0);
        let tiny = || black_box(f64::MIN_POSITIVE) / black_box(4.0);
        let (third, denormal) = (compute(), tiny());
        set_mode(ODD);
        let (odd_third, odd_denormal) = (compute(), tiny());
        let (same_third, same_denormal) = in_standard_mode(|| (compute(), tiny()));
        let left = mode() & CONTROL;
        set_mode(STANDARD);
        assert_eq!(left, ODD);
        assert_eq!((same_third.to_bits(), same_denormal.to_bits()), (third.to_bits(), denormal.to_bits()));
        assert!(odd_third > third && odd_denormal == 0.0, "the odd mode was not in force");
    }
}
