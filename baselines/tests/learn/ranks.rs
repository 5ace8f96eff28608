//! Runs that several processes share: the laws, on threads that stand for processes.

use std::fs;
use std::ops::ControlFlow;
use std::sync::mpsc::{Receiver, Sender, channel};
use std::thread;

use baselines::learn::{
    AlgorithmSettings, CheckpointError, Resumed, TrainError, TrainSettings, Trainer,
};
use baselines::workers::{OneProcess, Workers, agree, gather_values, share, sum};
use baselines::{
    Evaluation, TrainedPolicy, ZeroPolicy, evaluate, evaluate_across_workers, gather_episodes,
};
use fetch_env::{Task, VecEnv, vec_env::VecConfig};
use tempfile::tempdir;

use crate::runs::{Outcome, Result, all_on, ddpg, make, outcome, ppo, sac, settings};

/// A thread that stands for a process.
#[derive(Debug)]
struct Thread {
    rank: usize,
    /// To each thread.
    senders: Vec<Sender<Vec<u8>>>,
    /// From each thread.
    receivers: Vec<Receiver<Vec<u8>>>,
}

impl Workers for Thread {
    fn rank(&self) -> usize {
        self.rank
    }

    fn size(&self) -> usize {
        self.senders.len()
    }

    fn average(&mut self, numbers: &mut [f32]) {
        let message: Vec<u8> = numbers.iter().flat_map(|number| number.to_le_bytes()).collect();
        let messages = self.gather(&message);
        for (index, number) in numbers.iter_mut().enumerate() {
            let element = |message: &Vec<u8>| f32::from_le_bytes(message.as_chunks().0[index]);
            *number = messages.iter().map(element).sum::<f32>() / messages.len() as f32;
        }
    }

    fn exchange(&mut self, messages: Vec<Vec<u8>>) -> Vec<Vec<u8>> {
        for (sender, message) in self.senders.iter().zip(messages) {
            sender.send(message).expect("the other thread runs");
        }
        let receive = |receiver: &Receiver<_>| receiver.recv().expect("the other thread runs");
        self.receivers.iter().map(receive).collect()
    }

    fn seconds(&self) -> f64 {
        0.0
    }
}

/// Runs a function on threads that stand for processes, and returns what it returns on each.
pub(crate) fn on_ranks<T: Send>(size: usize, run: impl Fn(Box<dyn Workers>) -> T + Sync) -> Vec<T> {
    let mut receivers: Vec<Vec<_>> = (0..size).map(|_| Vec::new()).collect();
    let mut senders = Vec::new();
    for _ in 0..size {
        let mut own = Vec::new();
        for receivers in &mut receivers {
            let (sender, receiver) = channel();
            own.push(sender);
            receivers.push(receiver);
        }
        senders.push(own);
    }
    let workers = senders.into_iter().zip(receivers).enumerate();
    let workers = workers.map(|(rank, (senders, receivers))| Thread { rank, senders, receivers });
    thread::scope(|scope| {
        let run = &run;
        let threads: Vec<_> =
            workers.map(|workers| scope.spawn(move || run(Box::new(workers)))).collect();
        threads.into_iter().map(|thread| thread.join().expect("the rank does not panic")).collect()
    })
}

/// A process whose messages are seen, or changed, before it sends them.
#[derive(Debug)]
struct Seen {
    workers: Box<dyn Workers>,
    see: fn(&mut Vec<u8>),
}

impl Workers for Seen {
    fn rank(&self) -> usize {
        self.workers.rank()
    }

    fn size(&self) -> usize {
        self.workers.size()
    }

    fn average(&mut self, numbers: &mut [f32]) {
        self.workers.average(numbers);
    }

    fn exchange(&mut self, mut messages: Vec<Vec<u8>>) -> Vec<Vec<u8>> {
        messages.iter_mut().for_each(self.see);
        self.workers.exchange(messages)
    }

    fn seconds(&self) -> f64 {
        self.workers.seconds()
    }
}

/// Cuts off the last byte of what rank 1 sends.
fn with_cut_messages(workers: Box<dyn Workers>) -> Box<dyn Workers> {
    if workers.rank() != 1 {
        return workers;
    }
    let see = |message: &mut Vec<u8>| {
        message.pop();
    };
    Box::new(Seen { workers, see })
}

fn train(workers: Box<dyn Workers>, settings: TrainSettings, steps: u64) -> Outcome {
    let run = || -> Result<Outcome> {
        let mut trainer = Trainer::with_workers(make, settings, 3, 1, workers)?;
        trainer.run(steps, None, |_, _| ControlFlow::Continue(()))?;
        outcome(&trainer)
    };
    run().expect("the run succeeds")
}

#[test]
fn ranks_end_with_the_same_bits_as_each_other_and_again() -> Result {
    for algorithm in [ddpg(), sac(), ppo()] {
        let settings = all_on(algorithm);
        let one = train(Box::new(OneProcess), settings.clone(), 600);
        assert!(on_ranks(1, |workers| train(workers, settings.clone(), 600)) == [one.clone()]);
        let two = on_ranks(2, |workers| train(workers, settings.clone(), 600));
        assert!(two[0] == two[1], "the ranks of a run differ");
        assert!(two[0] != one);
        assert!(on_ranks(2, |workers| train(workers, settings.clone(), 600)) == two);
    }
    Ok(())
}

/// Settings count for all ranks together or for each of them, and both learn.
#[test]
fn ranks_share_a_run_or_each_has_as_much() -> Result {
    for (per_rank, steps_of_a_cycle) in [(false, 100), (true, 200)] {
        let mut settings = settings(ddpg());
        settings.schedule.per_rank = per_rank;
        let target = baselines::learn::Target { success_rate: 0.9, evaluations: 2 };
        let runs = on_ranks(2, |workers| {
            let mut trainer = Trainer::with_workers(make, settings.clone(), 1, 1, workers)?;
            trainer.cycle()?;
            assert_eq!(trainer.counters().steps, steps_of_a_cycle);
            assert_eq!(trainer.counters().episodes, steps_of_a_cycle / 50);
            trainer.run(12_000, Some(target), |_, _| ControlFlow::Continue(()))?;
            Ok::<_, TrainError>(trainer.rows().to_vec())
        });
        for rows in runs {
            assert!(target.is_reached(&rows?));
        }
    }
    Ok(())
}

#[test]
fn a_run_that_cannot_be_shared_is_refused() {
    let mut uneven = settings(ddpg());
    uneven.schedule.num_envs = 3;
    for trainer in on_ranks(2, |workers| Trainer::with_workers(make, uneven.clone(), 1, 1, workers))
    {
        let error = trainer.map(|_| ()).expect_err("3 environments on 2 ranks");
        assert!(error.to_string().contains("num_envs is 3: choose a multiple"), "{error}");
    }
    let errors = on_ranks(3, |workers| {
        let seed = if workers.rank() == 2 { 8 } else { 7 };
        Trainer::with_workers(make, settings(ddpg()), seed, 1, workers).map(|_| ()).unwrap_err()
    });
    for error in errors {
        let text = error.to_string();
        assert!(text.contains("rank 2 has a different seed than rank 0: 8 instead of 7"), "{text}");
    }
    for (change, words) in [
        (discount_less as fn(&mut TrainSettings), "gamma than rank 0: 0.9 instead of 0.95"),
        (|settings| settings.algorithm = sac(), "algorithm than rank 0: sac instead of ddpg"),
    ] {
        let errors = on_ranks(2, |workers| {
            let mut settings = settings(ddpg());
            if workers.rank() == 1 {
                change(&mut settings);
            }
            Trainer::with_workers(make, settings, 7, 1, workers).map(|_| ()).unwrap_err()
        });
        for error in errors {
            let text = error.to_string();
            assert!(text.contains(&format!("rank 1 has a different {words}")), "{text}");
        }
    }
}

fn discount_less(settings: &mut TrainSettings) {
    if let AlgorithmSettings::Ddpg(ddpg) = &mut settings.algorithm {
        ddpg.gamma = 0.9;
    }
}

#[test]
fn facts_that_differ_or_are_missing_are_named() {
    for (facts, words) in [
        (&[("task", "a"), ("version", "3.6.0")][..], "version than rank 0: 3.6.0 instead of 4.0.1"),
        (&[("task", "a")], "version than rank 0: none instead of 4.0.1"),
        (&[], "task than rank 0: none instead of a"),
        (&[("version", "4.0.1")], "task than rank 0: none instead of a"),
        (
            &[("task", "a"), ("version", "4.0.1"), ("model", "b")],
            "model than rank 0: b instead of none",
        ),
    ] {
        let answers = on_ranks(3, |mut workers| {
            let first = &[("task", "a"), ("version", "4.0.1")][..];
            let facts = if workers.rank() == 1 { facts } else { first };
            let facts: Vec<_> =
                facts.iter().map(|(name, fact)| (*name, (*fact).to_owned())).collect();
            agree(&mut *workers, &facts)
        });
        for answer in answers {
            let text = answer.unwrap_err().to_string();
            assert!(text.contains(&format!("rank 1 has a different {words}")), "{text}");
        }
    }
}

/// Every process gets the error, so that none goes on without the others.
#[test]
fn a_message_that_cannot_be_read_names_its_rank() {
    let values = on_ranks(3, |workers| gather_values(&mut *with_cut_messages(workers), &[7, 8]));
    assert!(values.iter().all(|values| matches!(values, Err(error) if error.rank == 1)));
    let sums = on_ranks(3, |workers| sum(&mut *with_cut_messages(workers), 7));
    assert!(sums.iter().all(|sum| matches!(sum, Err(error) if error.rank == 1)), "{sums:?}");
    let facts = [("seed", "7".to_owned())];
    for answer in on_ranks(3, |workers| agree(&mut *with_cut_messages(workers), &facts)) {
        let disagreement = answer.unwrap_err();
        assert_eq!((disagreement.rank, disagreement.what.as_str()), (1, "program"));
    }
    let mut env = make().expect("an environment");
    for count in [0, 2] {
        let own = evaluate(&mut env, &mut ZeroPolicy, count, 0, |_| ()).expect("episodes");
        for gathered in
            on_ranks(3, |workers| gather_episodes(&mut *with_cut_messages(workers), &own))
        {
            assert_eq!(gathered.unwrap_err().rank, 1);
        }
    }
    // A value that JSON cannot hold.
    let not_finite = on_ranks(2, |mut workers| {
        let number = if workers.rank() == 1 { f64::NAN } else { 1.0 };
        gather_values(&mut *workers, &number)
    });
    assert!(not_finite.iter().all(|values| matches!(values, Err(error) if error.rank == 1)));
}

#[test]
fn a_cycle_that_a_rank_does_not_report_ends_the_run() {
    let errors = on_ranks(2, |workers| {
        // From the first cycle on: the settings have been compared then.
        let see = |message: &mut Vec<u8>| {
            if message.starts_with(b"{\"steps\":") {
                message.pop();
            }
        };
        let is_cut = workers.rank() == 1;
        let workers = if is_cut { Box::new(Seen { workers, see }) } else { workers };
        Trainer::with_workers(make, settings(ddpg()), 1, 1, workers)?.cycle()
    });
    for error in errors {
        assert!(
            matches!(&error, Err(TrainError::Unreadable(message)) if message.rank == 1),
            "{error:?}"
        );
    }
}

/// Comparing weights takes time, and one process has none to compare them with.
#[test]
fn one_process_does_not_compare_weights() -> Result {
    let see = |message: &mut Vec<u8>| {
        let text = String::from_utf8_lossy(message);
        assert!(!text.contains("weights"), "{text}");
    };
    let workers = Box::new(Seen { workers: Box::new(OneProcess), see });
    let mut trainer = Trainer::with_workers(make, settings(ddpg()), 1, 1, workers)?;
    trainer.run(600, None, |_, _| ControlFlow::Continue(()))?;
    assert!(!trainer.rows().is_empty());
    Ok(())
}

#[test]
fn a_run_ends_where_any_rank_says() {
    let rows = on_ranks(2, |workers| {
        let rank = workers.rank();
        let mut trainer = Trainer::with_workers(make, settings(ddpg()), 1, 1, workers)?;
        trainer.run(5_000, None, |trainer, _| {
            let is_over = rank == 1 && trainer.rows().len() == 2;
            if is_over { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
        })?;
        Ok::<_, TrainError>(trainer.rows().len())
    });
    assert_eq!(rows.into_iter().collect::<Result<Vec<_>, _>>().unwrap(), [2, 2]);
}

#[test]
fn a_resumed_run_of_as_many_ranks_ends_with_the_same_bits() -> Result {
    resume_on_ranks(all_on(ddpg()))?;
    resume_on_ranks(all_on(ppo()))
}

fn resume_on_ranks(mut settings: TrainSettings) -> Result {
    settings.schedule.num_envs = 4;
    // Episodes are under way when the checkpoint is saved.
    settings.schedule.steps_per_cycle = 30;
    let whole = on_ranks(2, |workers| train(workers, settings.clone(), 1_000));
    let folder = tempdir()?;
    let path = folder.path();
    let save = |workers| {
        let mut trainer = Trainer::with_workers(make, settings.clone(), 3, 1, workers)?;
        trainer.run(500, None, |_, _| ControlFlow::Continue(()))?;
        trainer.save(path)
    };
    for saved in on_ranks(2, save) {
        assert!(saved?.exists());
    }
    assert_eq!(fs::read_dir(path)?.count(), 1);
    let resumed = on_ranks(2, |workers| {
        let (mut trainer, resumed) = Trainer::resume_with_workers(make, path, 1, workers)?;
        assert_eq!(resumed, Resumed::Exactly);
        trainer.run(1_000, None, |_, _| ControlFlow::Continue(()))?;
        Ok::<_, CheckpointError>(outcome(&trainer).expect("the policy is finite"))
    });
    let resumed: Vec<_> = resumed.into_iter().collect::<Result<_, _>>()?;
    assert!(resumed == whole);

    // On other numbers of ranks, all finished episodes are there, and the run continues.
    for size in [1, 4] {
        let mut lens = on_ranks(size, |workers| {
            let (mut trainer, resumed) = Trainer::resume_with_workers(make, path, 1, workers)?;
            assert_eq!(resumed, Resumed::OnOtherRanks { before: 2 });
            let steps = trainer.counters().steps;
            trainer.cycle()?;
            assert!(trainer.counters().steps > steps);
            Ok::<_, CheckpointError>(trainer.counters().steps)
        });
        assert!(lens.remove(0)? > 500);
    }
    let alone = Trainer::resume(make, path, 1);
    assert!(alone.is_ok(), "{alone:?}");
    Ok(())
}

#[test]
fn an_evaluation_has_the_same_episodes_on_any_number_of_ranks() -> Result {
    let evaluate = |mut workers: Box<dyn Workers>| -> Evaluation {
        let envs: Vec<_> = (0..4).map(|_| make().expect("an environment")).collect();
        let mut envs = VecEnv::new(envs, VecConfig::default()).expect("environments of one kind");
        let mut policy = TrainedPolicy::shipped(Task::Reach).expect("shipped");
        evaluate_across_workers(&mut *workers, &mut envs, &mut policy, 10, 5, |_| ())
            .expect("episodes")
    };
    let one = evaluate(Box::new(OneProcess));
    for size in 2..=4 {
        for evaluation in on_ranks(size, evaluate) {
            assert_eq!(evaluation, one, "{size} ranks");
        }
    }
    Ok(())
}

#[test]
fn shares_are_consecutive_and_even() {
    for size in 1..6 {
        let shares = on_ranks(size, |mut workers| {
            assert_eq!(sum(&mut *workers, 2), Ok(2 * size as u64));
            share(&*workers, 11)
        });
        assert_eq!(
            shares.iter().flat_map(Clone::clone).collect::<Vec<_>>(),
            (0..11).collect::<Vec<_>>()
        );
        assert!(
            shares.iter().all(|share| share.len() >= 11 / size && share.len() <= 11 / size + 1)
        );
    }
}
