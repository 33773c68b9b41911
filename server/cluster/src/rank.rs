//! A rank: does what the server tells rank 0, and rank 0 all.

use std::{
    io::{self, Write as _},
    net::TcpStream,
    sync::{
        Arc, Mutex, PoisonError,
        mpsc::{self, Receiver},
    },
    thread,
    time::Instant,
};

use nappe_sim::{interrupt::Interrupt, parallel::Communicator, report::StageClock, world::Simulation};

use crate::{
    cluster::Cluster,
    counted::Counted,
    link::{LinkError, MOST_BYTES, Receiver as LinkReceiver},
    message::{Answer, Hello, Order, Stepped, Token, VERSION},
    signs::{Voice, give_signs},
};

/// Does what the server tells at the other end of a link, until it says that this is the end. To be called on rank 0, on the
/// rayon pool that steps are to run on. `on_loss` is called in another thread as soon as the link has ended: this one may
/// then wait for a rank that hangs.
///
/// # Errors
/// When the link fails, or ends before its end was said: the job is then to be aborted, since other ranks wait.
pub fn lead(
    cluster: &Arc<dyn Cluster>,
    token: Token,
    mut stream: TcpStream,
    on_loss: impl FnOnce() + Send + 'static,
) -> Result<(), LinkError> {
    stream.set_nodelay(true)?;
    let threads = rayon::current_num_threads() as u32;
    stream.write_all(&token)?;
    let voice = Arc::new(Voice::new(stream.try_clone()?));
    voice.say(&Hello { version: VERSION.to_owned(), hosts: cluster.hosts(), threads })?;

    let steps = Arc::new(Mutex::new(Interrupt::default()));
    let orders = read_orders(stream, Arc::clone(&steps), on_loss)?;
    let mut rank = Rank::new(cluster);
    give_signs(&voice, &rank.communicator);
    loop {
        let order =
            orders.recv().unwrap_or_else(|_| Err(io::Error::from(io::ErrorKind::UnexpectedEof).into()))?;
        voice.begin();
        let mut bytes = postcard::to_stdvec(&order)?;
        rank.communicator.broadcast(&mut bytes);
        let answer = rank.obey(order);
        if let Some(simulation) = &rank.simulation {
            let wanted = std::mem::replace(
                &mut *steps.lock().unwrap_or_else(PoisonError::into_inner),
                simulation.interrupt().clone(),
            );
            // One that came before there was anything to give up.
            if wanted.is_requested() {
                simulation.interrupt().request();
            }
        }
        voice.answer(&answer)?;
        if answer == Answer::Ended {
            return Ok(());
        }
    }
}

/// Does what rank 0 tells, until it says that this is the end. To be called on every other rank, on the rayon pool that
/// steps are to run on.
///
/// # Errors
/// When rank 0 says what cannot be read.
pub fn follow(cluster: &Arc<dyn Cluster>) -> Result<(), LinkError> {
    let mut rank = Rank::new(cluster);
    let mut bytes = Vec::new();
    loop {
        cluster.broadcast(&mut bytes);
        if rank.obey(postcard::from_bytes(&bytes)?) == Answer::Ended {
            return Ok(());
        }
    }
}

/// Reads orders as they come, in a thread of its own: an interrupt acts at once, the others wait for their turn.
///
/// # Errors
/// When the system starts no thread.
fn read_orders(
    mut stream: TcpStream,
    steps: Arc<Mutex<Interrupt>>,
    on_loss: impl FnOnce() + Send + 'static,
) -> io::Result<Receiver<Result<Order, LinkError>>> {
    let (orders, received) = mpsc::channel();
    let body = move || {
        let mut receiver = LinkReceiver::new(MOST_BYTES);
        loop {
            let interrupt = || steps.lock().unwrap_or_else(PoisonError::into_inner).request();
            let order = match receiver.receive::<Order>(&mut stream) {
                Ok(Some(Order::Interrupt)) => {
                    interrupt();
                    continue;
                }
                Ok(Some(order)) => Ok(order),
                Ok(None) => Err(io::Error::from(io::ErrorKind::UnexpectedEof).into()),
                Err(error) => Err(error),
            };
            let is_last = !matches!(order, Ok(ref order) if *order != Order::End);
            let is_lost = order.is_err();
            if is_lost {
                interrupt();
            }
            // Nobody receives once the rank has ended.
            if orders.send(order).is_err() || is_last {
                if is_lost {
                    on_loss();
                }
                return;
            }
        }
    };
    let started = thread::Builder::new().spawn(body);
    started.map_err(|error| {
        io::Error::new(error.kind(), format!("the system starts no thread that reads it: {error}"))
    })?;
    Ok(received)
}

/// What a rank steps.
struct Rank {
    communicator: Arc<Counted>,
    simulation: Option<Simulation>,
}

impl Rank {
    fn new(cluster: &Arc<dyn Cluster>) -> Self {
        Self { communicator: Arc::new(Counted::new(Arc::clone(cluster))), simulation: None }
    }

    /// Does what is told; the answer is that of rank 0.
    fn obey(&mut self, order: Order) -> Answer {
        match (order, &mut self.simulation) {
            (Order::Build(setup, precision), _) => {
                let communicator: Arc<dyn Communicator> = Arc::<Counted>::clone(&self.communicator);
                let built = Simulation::over(&setup, precision, communicator);
                let built = built.map_err(|error| error.to_string());
                Answer::Built(built.map(|(simulation, warnings)| {
                    self.simulation = Some(simulation);
                    warnings
                }))
            }
            (Order::Apply(changes), Some(simulation)) => {
                Answer::Applied(simulation.apply(&changes).map_err(|error| error.to_string()))
            }
            (Order::Step, Some(simulation)) => {
                let begin = Instant::now();
                let mut clock = StageClock::start(|| begin.elapsed().as_secs_f64());
                let result = simulation.step(&mut clock);
                let (seconds, asked) = (clock.seconds.to_vec(), self.communicator.asked());
                Answer::Stepped(Box::new(Stepped { result, seconds, asked }))
            }
            (Order::Take, Some(simulation)) => Answer::Taken(Box::new(simulation.take())),
            (Order::Put(state), Some(simulation)) => {
                simulation.put(&state);
                Answer::Applied(Ok(()))
            }
            (Order::Look(field), Some(simulation)) => Answer::Looked(simulation.take_field(field)),
            // A server that asks for a step before there is anything to step is not one of ours.
            (
                Order::Apply(_)
                | Order::Step
                | Order::Take
                | Order::Put(_)
                | Order::Look(_)
                | Order::Interrupt
                | Order::End,
                _,
            ) => Answer::Ended,
        }
    }
}
