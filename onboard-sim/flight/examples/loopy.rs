use flight::nmpc::{Problem, SolveStatus, reference};
use flight::nmpc::solve;
use flight::profile::Profile;
use flight::dynamics::{PlanarState,PlanarModel};
struct R(u64);
impl R{ fn u(&mut self)->f64{ self.0=self.0.wrapping_add(0x9e37_79b9_7f4a_7c15); let mut b=self.0; b=(b^(b>>30)).wrapping_mul(0xbf58_476d_1ce4_e5b9); b=(b^(b>>27)).wrapping_mul(0x94d0_49bb_1331_11eb); ((b^(b>>31))>>11) as f64/(1u64<<53) as f64} fn g(&mut self)->f64{ (0..12).map(|_|self.u()).sum::<f64>()-6.0}}
fn pct(v:&mut Vec<f64>,p:f64)->f64{v.sort_by(f64::total_cmp); if v.is_empty(){0.0}else{v[((v.len()-1) as f64*p).round() as usize]}}
fn main(){
    let args: Vec<String> = std::env::args().collect();
    let has=|n:&str| args.iter().any(|a| a==n);
    let mut profile = Profile::builtin("paper-calibrated").unwrap();
    if !has("box") { profile.nmpc.limits.final_box=None; }
    if has("floor") { profile.nmpc.limits.altitude_min_m=Some(0.0); }
    let scale: f64 = args.iter().find_map(|a| a.strip_prefix("s=").and_then(|v| v.parse().ok())).unwrap_or(1.0);
    let n = profile.start.planar_state();
    let starts=[n, PlanarState{theta_rad:60f64.to_radians(),..n},PlanarState{theta_rad:120f64.to_radians(),..n},PlanarState{w_m_s:-1.,..n},PlanarState{w_m_s:1.,..n},PlanarState{q_rad_s:-5f64.to_radians(),..n},PlanarState{q_rad_s:5f64.to_radians(),..n}];
    let model=PlanarModel::from_profile(&profile);
    // kicks
    let (mut its,mut ts,mut bad)=(vec![],vec![],0);
    for s in &starts {
        let first=solve(&Problem::from_profile(&profile,*s,0.0,50,1.0),None);
        for k in (0..49).step_by(6).map(|k|k+1) { for (su,sw,sq) in [(1.,1.,1.),(-1.,1.,1.),(1.,-1.,1.),(-1.,-1.,-1.)] {
            let p=first.states[k];
            let x=PlanarState{u_m_s:p.u_m_s+su*0.02*scale,w_m_s:p.w_m_s+sw*0.02*scale,q_rad_s:p.q_rad_s+sq*scale*0.5f64.to_radians(),..p};
            let prob=Problem::from_profile(&profile,x,0.1*k as f64,50-k,1.0); let warm=first.shifted(k);
            let sol=solve(&prob,Some(&warm));
            let mut best=f64::INFINITY; for _ in 0..(if has("time"){20}else{0}) {let t=std::time::Instant::now(); std::hint::black_box(solve(&prob,Some(&warm))); best=best.min(t.elapsed().as_secs_f64()*1e6);}
            its.push(f64::from(sol.qp_iterations)); ts.push(best);
            if sol.status!=SolveStatus::Converged {bad+=1; if has("v"){println!("kick k {k} {su} {sw} {sq}: {:?} it {} stat {:.1e} feas {:.1e}",sol.status,sol.iterations,sol.kkt_stationarity,sol.kkt_feasibility);}}
        }}
    }
    println!("kick: {} solves, bad {bad}, sweeps median {} p90 {} p99 {} max {}; us median {:.1} p99 {:.1} max {:.1}",its.len(),pct(&mut its,0.5),pct(&mut its,0.9),pct(&mut its,0.99),pct(&mut its,1.0),pct(&mut ts,0.5),pct(&mut ts,0.99),pct(&mut ts,1.0));
    // closed loop disturbed
    let (mut its,mut ts,mut bad,mut total)=(vec![],vec![],0,0);
    let mut rng=R(7);
    let seeds=if has("time"){1}else{5};
    for _seed in 0..seeds { for s in &starts {
        let mut x=*s; let mut sol=solve(&Problem::from_profile(&profile,x,0.0,50,1.0),None);
        for k in 0..49 {
            x=model.rk4_step(&x,sol.inputs_rad[0],33.3,0.1);
            x.u_m_s+=scale*0.002*rng.g(); x.w_m_s+=scale*0.002*rng.g(); x.q_rad_s+=scale*0.05f64.to_radians()*rng.g();
            let prob=Problem::from_profile(&profile,x,0.1*(k+1) as f64,49-k,1.0); let warm=sol.shifted(1);
            let next=solve(&prob,Some(&warm));
            let mut best=f64::INFINITY; for _ in 0..(if has("time"){20}else{0}) {let t=std::time::Instant::now(); std::hint::black_box(solve(&prob,Some(&warm))); best=best.min(t.elapsed().as_secs_f64()*1e6);}
            its.push(f64::from(next.qp_iterations)); ts.push(best); total+=1;
            if next.status!=SolveStatus::Converged {bad+=1; if has("v") {println!("loop k {k}: {:?} it {} stat {:.1e} feas {:.1e} ref {:?}",next.status,next.iterations,next.kkt_stationarity,next.kkt_feasibility,reference::solve(&prob,Some(&warm)).status); }}
            sol=next;
        }
        if has("v"){println!("end {:?}",x);}
    }}
    println!("loop: {total} solves, bad {bad}, sweeps median {} p90 {} p99 {} max {}; us median {:.1} p99 {:.1} max {:.1}",pct(&mut its,0.5),pct(&mut its,0.9),pct(&mut its,0.99),pct(&mut its,1.0),pct(&mut ts,0.5),pct(&mut ts,0.99),pct(&mut ts,1.0));
}
