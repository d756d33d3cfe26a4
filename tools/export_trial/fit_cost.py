import json,sys,numpy as np
names=['step','input','feature','filter','rate','operation','function','memory','term','cell','element','weight','unit','tangent','kernel_term','kernel_value']
d=json.load(open(sys.argv[1]))
for t in ['m4f float','m7 double','m3 float','m7 float']:
    rows=[(k,v) for k,v in d.items() if k.endswith(t)]
    W=np.array([v['work'][3:] for k,v in rows]); y=np.array([v['instr'] for k,v in rows])
    # relative least squares, nonnegative
    from scipy.optimize import nnls
    A=W/y[:,None]; x,_=nnls(A,np.ones(len(y)))
    e=A@x-1
    print(t,len(rows),'instr max err %.1f %% rms %.1f %%'%(100*abs(e).max(),100*np.sqrt((e**2).mean())),'worst',[(rows[i][0],round(100*e[i],1)) for i in np.argsort(-abs(e))[:4]])
    print(dict(zip(names,np.round(x,2))))
    tab=np.array([v['work'][0] for k,v in rows]); ch=np.array([v['work'][2] for k,v in rows]); tx=np.array([v['text'] for k,v in rows])
    r=(tx-tab)/ch; c=np.median(r); e2=(tab+c*ch)/tx-1
    print('  code ratio %.4f max err %.1f %%'%(c,100*abs(e2).max()),[(rows[i][0],round(100*e2[i],1)) for i in np.argsort(-abs(e2))[:3]])
    st=np.array([sum(sorted(v['stack'])[-2:]) if v['stack'] else 0 for k,v in rows]); print('  stack',st.min(),st.max())
    print('  rc',set(v['rc'] for k,v in rows),'undef',set(v['undef'] for k,v in rows),'self max',max(v['self'] for k,v in rows))
