//! Networks that see pictures: against plain loops in double precision, their gradients against
//! differences, and their bits on any number of threads.

use baselines::learn::network::{
    Convolution, PictureNetwork, PicturePass, PictureShape, PictureShapeError,
};
use proptest::prelude::*;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rayon::ThreadPoolBuilder;

/// What a [`PictureShape`] is made of.
#[derive(Clone, Debug)]
struct Plan {
    size: [usize; 2],
    convolutions: Vec<Convolution>,
    numbers: usize,
    hidden: Vec<usize>,
    outputs: usize,
}

impl Plan {
    fn shape(&self) -> Result<PictureShape, PictureShapeError> {
        let Self { size, convolutions, numbers, hidden, outputs } = self;
        PictureShape::new(*size, convolutions, *numbers, hidden, *outputs)
    }

    fn small() -> Self {
        let convolutions = [
            Convolution { channels: 6, kernel: 5, stride: 2, padding: 2 },
            Convolution { channels: 5, kernel: 3, stride: 1, padding: 1 },
            Convolution { channels: 4, kernel: 3, stride: 2, padding: 0 },
        ];
        let convolutions = convolutions.to_vec();
        Self { size: [12, 14], convolutions, numbers: 3, hidden: vec![7, 6], outputs: 2 }
    }

    /// The outputs for one picture, computed in double precision, loop by loop.
    fn outputs(&self, parameters: &[f64], pixels: &[f64], numbers: &[f32]) -> Vec<f64> {
        let mut parameters = parameters.iter();
        let mut take =
            |len: usize| -> Vec<f64> { parameters.by_ref().take(len).copied().collect() };
        let ([mut height, mut width], mut inputs) = (self.size, 3);
        let mut picture = pixels.to_vec();
        for (number, convolution) in self.convolutions.iter().enumerate() {
            let Convolution { channels, kernel, stride, padding } = *convolution;
            let weights = take(kernel * kernel * inputs * channels);
            let is_last = number + 1 == self.convolutions.len();
            let biases = if is_last { vec![0.0; channels] } else { take(channels) };
            let [rows, columns] =
                [height, width].map(|side| (side + 2 * padding - kernel) / stride + 1);
            let mut next = Vec::new();
            for (row, column) in (0..rows * columns).map(|at| (at / columns, at % columns)) {
                for channel in 0..channels {
                    let mut sum = biases[channel];
                    for term in 0..kernel * kernel * inputs {
                        let (pixel, input) = (term / inputs, term % inputs);
                        let y = (row * stride + pixel / kernel).wrapping_sub(padding);
                        let x = (column * stride + pixel % kernel).wrapping_sub(padding);
                        if y < height && x < width {
                            let at = (y * width + x) * inputs + input;
                            sum += picture[at] * weights[term * channels + channel];
                        }
                    }
                    next.push(if is_last { sum } else { sum.max(0.0) });
                }
            }
            (picture, height, width, inputs) = (next, rows, columns, channels);
        }
        let place = |at: usize, len: usize| 2.0 * at as f64 / (len.max(2) - 1) as f64 - 1.0;
        let mean = |channel: usize, value: &dyn Fn(usize) -> f64| {
            let exponentials =
                picture.iter().skip(channel).step_by(inputs).map(|value| value.exp());
            let total: f64 = exponentials.clone().sum();
            exponentials.enumerate().map(|(at, share)| share / total * value(at)).sum::<f64>()
        };
        let mut layer: Vec<f64> = numbers.iter().map(|number| f64::from(*number)).collect();
        layer.extend((0..inputs).map(|channel| mean(channel, &|at| place(at % width, width))));
        layer.extend((0..inputs).map(|channel| mean(channel, &|at| place(at / width, height))));
        for (number, len) in self.hidden.iter().chain([&self.outputs]).enumerate() {
            let (weights, biases) = (take(layer.len() * len), take(*len));
            let output = |at: usize| {
                let products = layer.iter().zip(weights.iter().skip(at).step_by(*len));
                let sum = biases[at] + products.map(|(input, weight)| input * weight).sum::<f64>();
                if number < self.hidden.len() { sum.max(0.0) } else { sum }
            };
            layer = (0..*len).map(output).collect();
        }
        layer
    }
}

/// Networks, pictures and numbers: `count` rows.
struct Case {
    plan: Plan,
    network: PictureNetwork,
    pictures: Vec<u8>,
    numbers: Vec<f32>,
    count: usize,
}

impl Case {
    fn new(plan: Plan, count: usize, seed: u64) -> Result<Self, PictureShapeError> {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let mut network = PictureNetwork::init(plan.shape()?, &mut rng);
        let len = count * network.shape().picture_len();
        let pictures: Vec<u8> = (0..len).map(|_| rng.random()).collect();
        network.measure(&pictures);
        let numbers = (0..count * plan.numbers).map(|_| rng.random_range(-1.0..1.0)).collect();
        Ok(Self { plan, network, pictures, numbers, count })
    }

    /// The outputs of all rows in double precision.
    fn outputs(&self, parameters: &[f64]) -> Vec<f64> {
        let (mean, scale) = self.network.mean_and_scale();
        let pictures = self.pictures.chunks_exact(mean.len()).enumerate();
        let outputs = pictures.map(|(row, picture)| {
            let pixel = |(byte, mean): (&u8, &f32)| {
                (f64::from(*byte) - f64::from(*mean)) * f64::from(scale)
            };
            let pixels: Vec<f64> = picture.iter().zip(mean).map(pixel).collect();
            let numbers = &self.numbers[row * self.plan.numbers..][..self.plan.numbers];
            self.plan.outputs(parameters, &pixels, numbers)
        });
        outputs.flatten().collect()
    }

    fn check(&self, pass: &mut PicturePass, rng: &mut ChaCha8Rng) {
        let parameters: Vec<f64> =
            self.network.parameters().iter().map(|n| f64::from(*n)).collect();
        let expected = self.outputs(&parameters);
        let outputs = pass.run(&self.network, &self.pictures, &self.numbers);
        for (output, expected) in outputs.iter().zip(&expected) {
            let error = (f64::from(*output) - expected).abs();
            assert!(error < 1e-5 * (1.0 + expected.abs()), "{output} {expected} {:?}", self.plan);
        }
        // The loss is the sum of squared outputs.
        let mut gradient = vec![f32::NAN; parameters.len()];
        pass.backward(&self.network, |_, output| 2.0 * output, &mut gradient);
        let loss = |parameters: &[f64]| -> f64 {
            self.outputs(parameters).iter().map(|output| output * output).sum()
        };
        let largest = gradient.iter().fold(1.0_f32, |largest, slope| largest.max(slope.abs()));
        let step = 1e-6;
        for _ in 0..60 {
            let at = rng.random_range(0..parameters.len());
            let [high, low] = [step, -step].map(|step| {
                let mut other = parameters.clone();
                other[at] += step;
                loss(&other)
            });
            let (slope, difference) = (f64::from(gradient[at]), (high - low) / (2.0 * step));
            let error = (slope - difference).abs();
            let tolerance = 1e-4 * f64::from(largest);
            assert!(error < tolerance, "parameter {at}: {slope} {difference} {:?}", self.plan);
        }
    }

    /// The bits of outputs and gradient on some threads.
    fn bits(&self, num_threads: usize) -> Vec<u32> {
        let pool = ThreadPoolBuilder::new().num_threads(num_threads).build().expect("threads");
        let mut pass = PicturePass::default();
        let mut gradient = vec![0.0; self.network.parameters().len()];
        let mut bits = Vec::new();
        pool.install(|| {
            let outputs = pass.run(&self.network, &self.pictures, &self.numbers);
            bits.extend(outputs.iter().map(|number| number.to_bits()));
            pass.backward(&self.network, |_, output| output, &mut gradient);
        });
        bits.extend(gradient.iter().map(|number| number.to_bits()));
        bits
    }
}

fn plans() -> impl Strategy<Value = Plan> {
    let convolution = (1..10_usize, 1..5_usize, 1..4_usize, 0..4_usize).prop_map(
        |(channels, kernel, stride, padding)| Convolution {
            channels,
            kernel,
            stride,
            padding: padding % kernel,
        },
    );
    let convolutions = prop::collection::vec(convolution, 1..4);
    let hidden = prop::collection::vec(1..9_usize, 0..3);
    ([1..13_usize, 1..13], convolutions, 0..4_usize, hidden, 1..4_usize).prop_map(
        |(size, convolutions, numbers, hidden, outputs)| Plan {
            size,
            convolutions,
            numbers,
            hidden,
            outputs,
        },
    )
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(48))]

    /// Each shape is refused, or computes what plain loops do, with their gradient.
    #[test]
    fn shapes_compute_what_plain_loops_do(plan in plans(), count in 1..11_usize, seed in any::<u64>()) {
        match Case::new(plan, count, seed) {
            Ok(case) => {
                let mut rng = ChaCha8Rng::seed_from_u64(seed);
                case.check(&mut PicturePass::default(), &mut rng);
            }
            Err(error) => {
                let does_not_fit = matches!(error, PictureShapeError::Kernel { .. });
                prop_assert!(does_not_fit, "{}", error);
            }
        }
    }
}

#[test]
fn a_pass_takes_networks_and_rows_of_any_number_one_after_the_other() {
    let mut pass = PicturePass::default();
    let mut rng = ChaCha8Rng::seed_from_u64(1);
    let strided = Plan { size: [9, 11], ..Plan::small() };
    for (plan, count) in [(Plan::small(), 9), (strided, 3), (Plan::small(), 2), (Plan::small(), 6)]
    {
        Case::new(plan, count, 7).expect("a network").check(&mut pass, &mut rng);
    }
}

#[test]
fn bits_are_the_same_on_any_number_of_threads_and_in_any_company() {
    let case = Case::new(Plan::small(), 21, 5).expect("a network");
    let bits = case.bits(1);
    for num_threads in [2, 3, 5] {
        assert_eq!(case.bits(num_threads), bits);
    }
    let mut pass = PicturePass::default();
    let len = case.network.shape().picture_len();
    let alone = case.pictures.chunks_exact(len).zip(case.numbers.chunks_exact(3));
    let alone: Vec<u32> = alone
        .flat_map(|(picture, numbers)| pass.run(&case.network, picture, numbers).to_vec())
        .map(f32::to_bits)
        .collect();
    assert_eq!(alone, bits[..2 * case.count]);
}

#[test]
fn measured_pictures_have_mean_zero_and_variance_one() {
    let Case { network, pictures, .. } = Case::new(Plan::small(), 30, 2).expect("a network");
    let (mean, scale) = network.mean_and_scale();
    let numbers = pictures.iter().zip(mean.iter().cycle());
    let numbers = numbers.map(|(byte, mean)| f64::from((f32::from(*byte) - mean) * scale));
    let (sum, squares) = numbers.fold((0.0, 0.0), |(sum, squares), n| (sum + n, squares + n * n));
    let count = pictures.len() as f64;
    assert!((sum / count).abs() < 1e-4 && (squares / count - 1.0).abs() < 1e-4);

    // Equal pictures have no variance.
    let mut network = network;
    network.measure(&vec![9; network.shape().picture_len()]);
    assert_eq!(network.mean_and_scale(), (&*vec![9.0; network.shape().picture_len()], 1.0));
}

#[test]
fn impossible_shapes_are_refused() {
    let plan = Plan::small();
    let with = |change: &dyn Fn(&mut Plan)| {
        let mut plan = plan.clone();
        change(&mut plan);
        plan.shape().expect_err("it is impossible").to_string()
    };
    assert!(with(&|plan| plan.convolutions.clear()).contains("the number of convolutions is 0"));
    assert!(with(&|plan| plan.size[1] = 0).contains("the width of a picture is 0"));
    assert!(with(&|plan| plan.outputs = 0).contains("the number of outputs is 0"));
    assert!(with(&|plan| plan.hidden[1] = 0).contains("the length of a hidden layer is 0"));
    assert!(with(&|plan| plan.convolutions[0].stride = 0).contains("a stride is 0"));
    assert!(with(&|plan| plan.convolutions[0].channels = usize::MAX).contains("choose from 1"));
    assert!(with(&|plan| plan.convolutions[1].padding = 3).contains("convolution 1 sees 3 x 3"));
    assert!(with(&|plan| plan.size = [4, 40]).contains("convolution 2 sees"));
    assert!(with(&|plan| plan.size = [16_000; 2]).contains("the number of parameters"));
    let wide = |plan: &mut Plan| plan.convolutions.iter_mut().for_each(|own| own.channels = 16_000);
    assert!(with(&wide).contains("the number of parameters"));
    assert!(with(&|plan| plan.hidden = vec![16_000; 3]).contains("the number of parameters"));
}

#[test]
fn the_default_network_is_that_of_the_page() -> Result<(), PictureShapeError> {
    let shape = PictureShape::new([64, 64], &Convolution::defaults([64, 64]), 13, &[256, 256], 4)?;
    assert_eq!((shape.num_points(), shape.num_numbers(), shape.num_outputs()), (32, 13, 4));
    assert_eq!((shape.picture_size(), shape.picture_len()), ([64, 64], 12_288));
    let convolutions = (75 + 1) * 32 + (288 + 1) * 32 + 288 * 32;
    let head = (77 + 1) * 256 + (256 + 1) * 256 + (256 + 1) * 4;
    assert_eq!(shape.num_parameters(), convolutions + head);
    Ok(())
}
