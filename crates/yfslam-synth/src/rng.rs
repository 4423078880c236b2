//! Seeded random numbers: hashes for random access (one draw per pixel and frame) and a small stream generator.
//!
//! In: a seed and a stream number. Out: the same draws on every machine and thread. The mixing function is the finaliser of
//! SplitMix64 (Steele, Lea, Flood, "Fast splittable pseudorandom number generators", OOPSLA 2014, figure 16).

/// Mixes 64 bits so that each input bit flips each output bit with probability one half.
pub fn mix(mut x: u64) -> u64 {
    x = (x ^ (x >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    x = (x ^ (x >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    x ^ (x >> 31)
}

/// Returns the hash of a seed and one index.
pub fn hash(seed: u64, index: u64) -> u64 {
    mix(seed ^ mix(index.wrapping_add(0x9e37_79b9_7f4a_7c15)))
}

/// Returns four independent, nearly normal draws of zero mean and unit variance, within ±3.47 sigma.
pub fn normals4(bits: u64) -> [f32; 4] {
    // Irwin–Hall of order 4 on 16-bit words from two mixes: variance 4/12, so sqrt(3) scales it to one.
    let more = mix(bits ^ 0x5851_f42d_4c95_7f2d);
    let third = mix(bits ^ 0x1405_7b7e_f767_814f);
    let last = mix(bits ^ 0xd134_2543_de82_ef95);
    std::array::from_fn(|k| {
        let part = |b: u64| f32::from((b >> (16 * k)) as u16) * (1.0 / 65536.0);
        (part(bits) + part(more) + part(third) + part(last) - 2.0 + 2.0 / 65536.0) * 1.732_050_8
    })
}

/// A stream of draws for building a world (SplitMix64).
#[derive(Clone, Debug)]
pub struct Rng(u64);

impl Rng {
    /// Creates stream number `stream` of `seed`; streams do not overlap in practice.
    pub fn new(seed: u64, stream: u64) -> Self {
        Self(hash(seed, stream))
    }

    /// Returns the next 64 bits.
    pub fn bits(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        mix(self.0)
    }

    /// Returns a uniform draw in [low, high).
    pub fn range(&mut self, low: f32, high: f32) -> f32 {
        low + (high - low) * ((self.bits() >> 40) as f32 / 16_777_216.0)
    }

    /// Returns a uniform draw in [low, high) as `f64`.
    pub fn range64(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * ((self.bits() >> 11) as f64 / 9_007_199_254_740_992.0)
    }

    /// Returns a uniform draw in 0..n; 0 if `n` is 0.
    pub fn below(&mut self, n: usize) -> usize {
        ((u128::from(self.bits()) * n as u128) >> 64) as usize
    }

    /// Returns true with probability `p`.
    pub fn chance(&mut self, p: f32) -> bool {
        self.range(0.0, 1.0) < p
    }

    /// Returns one of `items`.
    pub fn pick<T: Copy, const N: usize>(&mut self, items: [T; N]) -> T {
        const { assert!(N > 0) };
        items[self.below(N)]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn normal_draws_have_zero_mean_and_unit_variance() {
        let draws: Vec<f32> = (0..50_000).flat_map(|i| normals4(hash(3, i))).collect();
        let mean = draws.iter().sum::<f32>() / draws.len() as f32;
        let variance = draws.iter().map(|d| (d - mean).powi(2)).sum::<f32>() / draws.len() as f32;
        assert!(mean.abs() < 0.01, "mean {mean}");
        assert!((variance - 1.0).abs() < 0.02, "variance {variance}");
    }

    #[test]
    fn streams_of_one_seed_differ() {
        assert_ne!(Rng::new(1, 0).bits(), Rng::new(1, 1).bits());
        assert_ne!(Rng::new(1, 0).bits(), Rng::new(2, 0).bits());
    }
}
