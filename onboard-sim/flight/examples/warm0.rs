use flight::nmpc::{Problem, solve};
use flight::profile::Profile;
fn main(){ let profile = Profile::builtin("paper-calibrated").unwrap(); let n=profile.start.planar_state();
 let p=Problem::from_profile(&profile,n,0.0,50,1.0); let a=solve(&p,None); println!("{:?} {:.3e} {:.3e} {:?}",a.status,a.kkt_stationarity,a.kkt_feasibility,a.end_multipliers);
 for c in p.conditions().iter().zip(&a.end_multipliers) { let st: Vec<[f64;6]> = a.states.iter().map(|s|s.to_array()).collect(); println!("{:?} c {:.3e} y {:.6e} cy {:.2e}",c.0,c.0.value(&st),c.1,c.0.value(&st)*c.1); }
 let mut q=p.clone(); q.solver.max_iterations=0; let b=solve(&q,Some(&a.shifted(0))); println!("{:?} {:.3e} {:.3e}",b.status,b.kkt_stationarity,b.kkt_feasibility);}
