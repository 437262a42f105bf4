use flight::nmpc::{Problem, solve, reference};
use flight::profile::Profile;
use flight::dynamics::PlanarState;
fn main(){
    let args: Vec<String> = std::env::args().collect();
    let mut profile = Profile::builtin("paper-calibrated").unwrap();
    if !args.iter().any(|a| a=="box") { profile.nmpc.limits.final_box=None; }
    let n = profile.start.planar_state();
    let starts=[n, PlanarState{theta_rad:60f64.to_radians(),..n},PlanarState{theta_rad:120f64.to_radians(),..n},PlanarState{w_m_s:-1.,..n},PlanarState{w_m_s:1.,..n},PlanarState{q_rad_s:-5f64.to_radians(),..n},PlanarState{q_rad_s:5f64.to_radians(),..n}];
    let only: Option<usize> = args.get(1).and_then(|a| a.parse().ok());
    let mut logsum=0.0;
    for (i,s) in starts.iter().enumerate(){ if only.is_some_and(|o| o!=i){continue}
        let p=Problem::from_profile(&profile,*s,0.0,50,1.0);
        let sol=solve(&p,None);
        let mut best=f64::INFINITY;
        if !args.iter().any(|a| a=="trace") { for _ in 0..300 { let t=std::time::Instant::now(); std::hint::black_box(solve(&p,None)); best=best.min(t.elapsed().as_secs_f64()); } }
        logsum+=(best*1e6).ln();
        let r = if args.iter().any(|a| a=="ref") { reference::solve(&p,None).cost } else {0.0};
        println!("{i}: {:?} J {:.4} ref {r:.4} it {} sweeps {} stat {:.1e} feas {:.1e} miss {:.1e} y {:.3} t {:.1} us  per sweep {:.2}",sol.status,sol.cost,sol.iterations,sol.qp_iterations,sol.kkt_stationarity,sol.kkt_feasibility,sol.condition_miss,sol.terminal_multiplier(),best*1e6,best*1e6/f64::from(sol.qp_iterations));
    }
    println!("geomean {:.1} us",(logsum/7.0).exp());
}
