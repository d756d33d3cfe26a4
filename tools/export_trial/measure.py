import subprocess,sys,os,re,json,glob
os.chdir('.')
targets=[('m4f','float'),('m7','double'),('m3','float'),('m7','float')]
out={}
for m in sorted(glob.glob('cost/*.safetensors')):
    name=os.path.basename(m)[:-12]
    csv='ht.csv' if name.startswith(('gru','lstm','h')) and name not in('hw','hw2') else 'te.csv'
    for cpu,real in targets:
        w=subprocess.run(['./driver',m,'out',real,csv],capture_output=True,text=True,env={**os.environ,'WORK':'1','CALM':'1'}).stdout
        line=[l for l in w.splitlines() if l.startswith('WORK')]
        if not line: print(name,'no work',w[:100]); continue
        a=subprocess.run(['bash','arm/arm.sh',m,real,cpu,csv],stdout=subprocess.PIPE,stderr=subprocess.STDOUT,text=True,env={**os.environ,'CALM':'1'}).stdout
        mi=re.search(r'2000 steps (\d+)',a); mt=re.search(r'\n\s*(\d+)\s+\d+\s+\d+\s+\d+\s+\w+\tjoint_arm.o',a); st=[int(x) for x in re.findall(r'\t(\d+)\tstatic',a)]; rc=re.search(r'exit (\d+)',a); un=re.search('undefined: (.*)',a); sf=re.search(r'x1e-9 (\d+)',a)
        if not mi or not mt: print(name,cpu,real,a[-300:]); continue
        out['%s %s %s'%(name,cpu,real)]=dict(work=[float(x) for x in line[0].split()[1:]],instr=int(mi.group(1))*40/2000,text=int(mt.group(1)),stack=st,rc=rc.group(1),undef=un.group(1).strip(),self=int(sf.group(1)))
json.dump(out,open('cost/data.json','w'))
print(len(out))
