//! An animation of a glTF file: where it moves nodes to at a time.

use gltf::animation::{Interpolation, Property};

use super::{
    asset::Asset,
    frame::Ending,
    matrix::{Parts, straight, turned},
};
use crate::words::error::Result;

/// A share of a frame (1), by which times of binary32 are off a frame at most.
const NEAR: f64 = 1e-6;

/// One animation of a file.
#[derive(Debug)]
pub(super) struct Clip {
    channels: Vec<Channel>,
    others: usize,
}

/// What one property of a node is from key to key.
#[derive(Debug)]
struct Channel {
    node: usize,
    property: Property,
    between: Interpolation,
    /// Times of the keys (s), of which each is later than the one before.
    times: Vec<f64>,
    /// Numbers of each key; of a cubic spline the slope before it, itself, and the slope behind it.
    values: Vec<f64>,
}

impl Clip {
    /// Reads the animation with this number.
    ///
    /// # Errors
    /// A file without animations, another number than it has, and keys that do not fit.
    pub(super) fn read(asset: &Asset, number: usize) -> Result<Self> {
        let count = asset.document.animations().count();
        let Some(animation) = asset.document.animations().nth(number) else {
            return Err(asset.refused(&match count {
                0 => {
                    "has no animation; allowed: a file with a skin and an animation that moves it".to_owned()
                }
                _ => format!("has no animation {number}; allowed: 0 to {}", count - 1),
            }));
        };
        let mut channels = Vec::new();
        for channel in animation.channels() {
            let (target, sampler) = (channel.target(), channel.sampler());
            let (property, between) = (target.property(), sampler.interpolation());
            // Meshes with shapes to morph to are refused, so that their weights move nothing here.
            let width = match property {
                Property::MorphTargetWeights => continue,
                Property::Rotation => 4,
                Property::Translation | Property::Scale => 3,
            };
            let times = asset.numbers(&sampler.input(), 1)?;
            let values = asset.numbers(&sampler.output(), width)?;
            let of_key = width * if between == Interpolation::CubicSpline { 3 } else { 1 };
            let is_ordered = times[0] >= 0.0 && times.is_sorted_by(|a, b| a < b);
            if !is_ordered || values.len() != of_key * times.len() {
                let (index, node) = (channel.index(), target.node().index());
                return Err(asset.refused(&format!(
                    "animation {number}, channel {index} (node {node}): has {} times for {} numbers; allowed: times from 0 on, \
                     each later than the one before, and {of_key} numbers for each",
                    times.len(),
                    values.len()
                )));
            }
            channels.push(Channel { node: target.node().index(), property, between, times, values });
        }
        if channels.is_empty() {
            return Err(asset.refused(&format!("animation {number} moves no node; allowed: one that does")));
        }
        Ok(Self { channels, others: count - 1 })
    }

    /// How many other animations the file has.
    pub(super) fn others(&self) -> usize {
        self.others
    }

    /// How many frames there are from time 0 to the end, at so many in a second; 1 or more.
    pub(super) fn frames(&self, rate: f64, ending: Ending) -> usize {
        let end =
            self.channels.iter().filter_map(|channel| channel.times.last()).copied().fold(0.0, f64::max);
        let frames = match ending {
            Ending::Held => (end * rate * (1.0 + NEAR)).floor() + 1.0,
            Ending::Looped => (end * rate * (1.0 - NEAR)).ceil(),
        };
        frames.max(1.0) as usize
    }

    /// Where the nodes that it moves are in their parents at a time (s); `rest` is where all are without it.
    pub(super) fn moved(&self, time: f64, rest: &[Parts]) -> Vec<Option<Parts>> {
        // Keys have times of binary32: a frame that stands at a key shows it.
        let time = f64::from(time as f32);
        let mut moved = vec![None; rest.len()];
        for channel in &self.channels {
            let parts: &mut Parts = moved[channel.node].get_or_insert(rest[channel.node]);
            match channel.property {
                Property::Translation => parts.translation = channel.at(time, straight),
                Property::Rotation => parts.rotation = channel.at(time, turned),
                Property::Scale => parts.scale = channel.at(time, straight),
                Property::MorphTargetWeights => {}
            }
        }
        moved
    }
}

impl Channel {
    /// The property at a time (s): that of the first key before it, that of the last one after it.
    fn at<const N: usize>(
        &self,
        time: f64,
        between: impl Fn([f64; N], [f64; N], f64) -> [f64; N],
    ) -> [f64; N] {
        let next = self.times.partition_point(|key| *key <= time);
        let last = next.saturating_sub(1);
        if next == 0 || next == self.times.len() {
            return self.value(last);
        }
        let long = self.times[next] - self.times[last];
        let share = (time - self.times[last]) / long;
        match self.between {
            Interpolation::Step => self.value(last),
            Interpolation::Linear => between(self.value(last), self.value(next), share),
            Interpolation::CubicSpline => {
                let (from, to) = (self.value::<N>(last), self.value::<N>(next));
                let (out, into) = (self.numbers::<N>(3 * last + 2), self.numbers::<N>(3 * next));
                let (square, cube) = (share * share, share * share * share);
                std::array::from_fn(|c| {
                    (2.0 * cube - 3.0 * square + 1.0) * from[c]
                        + long * (cube - 2.0 * square + share) * out[c]
                        + (3.0 * square - 2.0 * cube) * to[c]
                        + long * (cube - square) * into[c]
                })
            }
        }
    }

    /// The property at a key.
    fn value<const N: usize>(&self, key: usize) -> [f64; N] {
        self.numbers(if self.between == Interpolation::CubicSpline { 3 * key + 1 } else { key })
    }

    /// So many numbers, of which those before are as many each.
    fn numbers<const N: usize>(&self, at: usize) -> [f64; N] {
        std::array::from_fn(|c| self.values[N * at + c])
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A channel that moves node 0 along x.
    fn channel(between: Interpolation, times: &[f64], along: &[f64]) -> Channel {
        let values = along.iter().flat_map(|x| [*x, 0.0, 0.0]).collect();
        Channel { node: 0, property: Property::Translation, between, times: times.to_vec(), values }
    }

    #[test]
    fn keys_are_joined_as_their_channel_says() {
        let x = |channel: &Channel, time: f64| channel.at::<3>(time, straight)[0];
        let [step, linear] = [Interpolation::Step, Interpolation::Linear]
            .map(|between| channel(between, &[0.5, 1.0, 2.0], &[1.0, 3.0, -1.0]));
        for (time, stepped, on_line) in
            [(0.0, 1.0, 1.0), (0.75, 1.0, 2.0), (1.0, 3.0, 3.0), (1.25, 3.0, 2.0), (9.0, -1.0, -1.0)]
        {
            assert_eq!((x(&step, time), x(&linear, time)), (stepped, on_line), "{time}");
        }
        // Of x = t³, from 1 s to 3 s, a cubic spline has the exact values and slopes at both ends.
        let cubic = channel(Interpolation::CubicSpline, &[1.0, 3.0], &[0.0, 1.0, 3.0, 27.0, 27.0, 0.0]);
        for time in [1.0_f64, 1.5, 2.2, 3.0] {
            assert!((x(&cubic, time) - time.powi(3)).abs() < 1e-13, "{time}");
        }
    }

    #[test]
    fn the_last_frame_stands_at_the_end_unless_the_first_one_follows_it() {
        let end = f64::from(0.7_f32);
        let clip =
            Clip { channels: vec![channel(Interpolation::Linear, &[0.0, end], &[0.0, 1.0])], others: 0 };
        assert_eq!([Ending::Held, Ending::Looped].map(|ending| clip.frames(30.0, ending)), [22, 21]);
        assert_eq!([Ending::Held, Ending::Looped].map(|ending| clip.frames(10.5, ending)), [8, 8]);
        assert_eq!([Ending::Held, Ending::Looped].map(|ending| clip.frames(0.1, ending)), [1, 1]);
    }
}
